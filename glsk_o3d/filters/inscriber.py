"""Inscriber: rings -> rings around places on the medial axis."""

from dataclasses import dataclass, replace

from ..data.contraction import Contraction
from ..geometry.inscribed_balls import medial_places
from ..parameters import documented, parameter
from ..pipeline import Filter, RunContext


@documented
@dataclass(frozen=True, kw_only=True)
class Inscriber(Filter[Contraction, Contraction]):
    """Move each point into the object, to the centre of the ball that touches it from inside, before it is contracted.

    Contraction shuts a hole that is narrower than the bars beside it, since its wall is bent more than theirs; from the
    centres it widens it. Points go as far as the ball is to be believed: not at all on a single flat face.

    No named pipeline has it: it opens narrow holes, but where a body is stout the medial axis has sheets, whose curve
    is less certain than that of the surface.

    References
    ----------
    Ma, Bae and Choi, 3D medial axis point approximation using nearest neighbors and the normal field, The Visual
    Computer 2012. Tagliasacchi et al., Mean curvature skeletons, SGP 2012, hold a contracted mesh to such places.

    Examples
    --------
    >>> from glsk_o3d import Connector, Contractor, Refiner, pipelines
    >>> from glsk_o3d.samples import torus
    >>> medial = pipelines.rings() | Inscriber() | Contractor() | Connector() | Refiner()
    >>> medial(torus(1000).points).n_loops
    1
    """

    share: float = parameter(1.0, "How far points go, over the way to the places and their trust.", low=0, high=1)

    def run(self, state: Contraction, context: RunContext) -> Contraction:
        places, trust = medial_places(state.positions, state.normals[state.survivors], state.rings)
        return replace(state, positions=state.positions + self.share * trust[:, None] * (places - state.positions))
