"""MeshSet: MeshLab's, with our filters among its own."""

import os
import re
import tempfile
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ...data.skeleton import Skeleton
from ...errors import GlskError, InvalidCloudError, InvalidParameterError, did_you_mean
from ...interop.packages import require
from ...io.skeletons import FORMATS
from . import builtin
from .layers import Layer
from .script import Call, read_script, script_text, write_script
from .steps import Step, read_steps, step
from .verbs import Verb, verbs

pymeshlab = require("pymeshlab")


class MeshSet(pymeshlab.MeshSet):  # type: ignore[misc, name-defined]
    """``pymeshlab.MeshSet`` with the filters of this package added.

    Our filters are called like MeshLab's, by name or as methods, and can be mixed with them in filter scripts. Each
    makes a new current layer: a skeleton has vertices, edges, and the radii as vertex scalars.

    A length is ``pymeshlab.PercentageValue`` or a string such as ``"2%"``, of the diagonal of the layer's bounding box
    as in MeshLab; or ``pymeshlab.PureValue`` or a float, in the units of the cloud. Defaults refer to the box of
    ``Sampler.frame`` as elsewhere in this package.

    Without pymeshlab the import of the class raises MissingPackageError.

    Examples
    --------
    >>> import glsk_o3d as glsk
    >>> from glsk_o3d.samples import torus
    >>> meshes = glsk.MeshSet()
    >>> meshes.add_points(torus(1000).points)
    >>> result = meshes.generate_curve_skeleton_glsk(connector_radius="2%")
    >>> result["loops"], meshes.current_mesh().edge_number() == result["edges"]
    (1, True)
    """

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__(*args, **kwargs)
        self._script: list[Step] = []
        self._made: dict[int, Layer] = {}  # what our filters made, by the number of the layer

    def apply_filter(self, filter_name: str, **params: Any) -> dict[str, Any]:
        """Apply a filter of MeshLab's or ours to the current layer.

        Parameters
        ----------
        filter_name : str
            One of `filter_list`.
        **params
            See `print_filter_parameter_list`.

        Returns
        -------
        dict of str to object
            Facts about the result.

        Raises
        ------
        InvalidParameterError, InvalidCloudError
            There is no such filter; or one of ours cannot be run so, or not on this layer.
        pymeshlab.PyMeshLabException
            A filter of MeshLab's failed.
        """
        if _known(filter_name) in verbs():
            done = step(verbs()[filter_name], _plain_lengths(params))
            result = self._run_ours(done)
        else:
            result = self._run_theirs(filter_name, params)
            done = Step(filter_name, params, self._last_call())
        self._script.append(done)
        return result

    def apply_step(self, step: Step, on_iteration: Callable[..., Any] | None = None) -> dict[str, Any]:
        """Run a filter of a script without adding it to the current script; ScriptError if it fails."""
        with step.named_in_errors():
            if step.verb is not None:
                return self._run_ours(step, on_iteration)
            try:
                return self._run_theirs(step.name, step.values)
            except Exception as error:  # pymeshlab's have no base of their own
                words = re.sub("</?[a-z]+>", " ", str(error)).split()  # MeshLab writes HTML
                raise GlskError(" ".join(words)) from error

    def _run_ours(self, step: Step, on_iteration: Callable[..., Any] | None = None) -> dict[str, Any]:
        assert step.verb is not None
        layer = step.verb.run(self.layer(step.values.get("layer", -1)), step.values, on_iteration)
        self.add_mesh(layer.to_pymeshlab(), layer.label)
        self._made = {number: known for number, known in self._made.items() if self.mesh_id_exists(number)}
        self._made[self.current_mesh_id()] = layer
        return {"layer": self.current_mesh_id(), **layer.facts()}

    def _run_theirs(self, name: str, params: dict[str, Any]) -> dict[str, Any]:
        if self.mesh_number():  # without a mesh it crashes
            for key, value in super().filter_parameter_values(name, **params).items():
                if builtin.is_layer(key, value) and not self.mesh_id_exists(value):
                    raise InvalidParameterError(f"{key} = {value}: there is no such layer")
        super().clear_filter_script()
        folder = os.getcwd()
        try:
            result: dict[str, Any] = super().apply_filter(name, **params)
            return result
        finally:
            os.chdir(folder)  # when Poisson's fails, it stays in a temporary folder that it has removed

    def _last_call(self) -> Call:
        """The filter of MeshLab's that ran last as MeshLab writes it, which alone knows how."""
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "last.mlx")
            super().save_filter_script(file)
            return read_script(file)[0]

    @staticmethod
    def filter_list() -> list[str]:
        """The names of all filters, MeshLab's and ours."""
        return [*pymeshlab.filter_list(), *verbs()]

    @staticmethod
    def print_filter_parameter_list(filter_name: str) -> None:
        """Print the parameters of a filter: of MeshLab's name, type and default, of ours what they mean."""
        verb = verbs().get(_known(filter_name))
        if verb is None:
            pymeshlab.print_filter_parameter_list(filter_name)
        else:
            print(verb.help)

    def load_filter_script(self, filter_script_name: str | os.PathLike[str]) -> None:
        """Make a script file the current script. It is checked and not run; ScriptError names faults."""
        self._script = read_steps(filter_script_name)

    def apply_filter_script(self) -> None:
        """Run the filters of the current script, in order, from the current layer on."""
        for recorded in self._script:
            self.apply_step(recorded)

    def save_filter_script(self, filter_script_name: str | os.PathLike[str]) -> None:
        """Write the current script: loaded filters, and those applied since. Our lengths in percent stay percentages.

        It does not record the current layer, so name the layer in our filters.
        """
        write_script(filter_script_name, [recorded.call for recorded in self._script])

    def clear_filter_script(self) -> None:
        """Make the current script empty."""
        self._script = []

    def print_filter_script(self) -> None:
        """Print the current script as it would be saved."""
        print(script_text([recorded.call for recorded in self._script]))

    def add_points(self, points: Any, name: str = "cloud") -> None:
        """Add a cloud, anything that `skeletonize` takes, as a new layer, which becomes the current one."""
        self.add_mesh(Layer.of(points).to_pymeshlab(), name)

    def layer(self, number: int = -1) -> Layer:
        """A layer for our filters, with their earlier results if its vertices and edges are unchanged.

        -1 is the current layer. InvalidCloudError without any, InvalidParameterError without one of that number.
        """
        if not self.mesh_number():
            raise InvalidCloudError("there is no layer: load a scan first")
        number = self.current_mesh_id() if number == -1 else number
        if not self.mesh_id_exists(number):
            raise InvalidParameterError(f"layer = {number}: there is no such layer")
        layer, known = Layer.of_mesh(self.mesh(number)), self._made.get(number)
        if known is None or not known.shows(layer):
            return layer
        skeleton, scalars = known.skeleton, self.mesh(number).vertex_scalar_array()
        if skeleton is not None and not np.array_equal(scalars, skeleton.radii, equal_nan=True):
            skeleton = replace(skeleton, radii=scalars, half_width=scalars, half_thickness=scalars)
        return replace(layer, edges=known.edges, skeleton=skeleton, source=known.source)

    def current_skeleton(self) -> Skeleton:
        """The skeleton in the current layer; its radii are the layer's scalars. InvalidCloudError if it has no edges.

        It has its report and its points if its vertices and edges are unchanged.
        """
        layer = self.layer()
        if layer.edges is None:
            raise InvalidCloudError(f"the current layer ({layer.label}) has no edges: it is no skeleton")
        return layer.to_skeleton()

    def load_scan(self, path: str | os.PathLike[str]) -> None:
        """Add a scan that `read_cloud` reads as a new layer, with the faces of a mesh and the quality of points.

        `load_new_mesh` reads MeshLab's formats, with textures and colours of faces.
        """
        layer = Layer.read(path)
        self.add_mesh(layer.to_pymeshlab(), layer.label)

    def save_current_mesh(self, file_name: str | os.PathLike[str], *args: Any, **kwargs: Any) -> None:
        """Write the current layer as pymeshlab; without options a layer of vertices and edges by `save_skeleton`.

        So PLY files keep edges and radii, which MeshLab drops, and all formats of skeletons are available.
        """
        lines = self.current_mesh().edge_number() and not self.current_mesh().face_number()
        if lines and not args and not kwargs and os.fspath(file_name).lower().endswith(tuple(FORMATS)):
            self.layer().save(file_name)
        else:
            super().save_current_mesh(os.fspath(file_name), *args, **kwargs)


def _known(name: str) -> str:
    """The name of a filter; InvalidParameterError if there is none."""
    if name not in MeshSet.filter_list():
        raise InvalidParameterError(did_you_mean(str(name), MeshSet.filter_list(), "filter"))
    return name


def _plain_lengths(params: dict[str, Any]) -> dict[str, Any]:
    """MeshLab's classes for lengths, which hold float32, as what our filters take."""

    def plain(value: Any) -> Any:
        if isinstance(value, pymeshlab.PercentageValue):
            return f"{np.float32(value.value())}%"
        return float(str(np.float32(value.value()))) if isinstance(value, pymeshlab.PureValue) else value

    return {name: plain(value) for name, value in params.items()}


def _method(verb: Verb) -> Callable[..., dict[str, Any]]:
    def apply(self: MeshSet, **params: Any) -> dict[str, Any]:
        return self.apply_filter(verb.name, **params)

    apply.__name__, apply.__qualname__, apply.__doc__ = verb.name, f"MeshSet.{verb.name}", verb.help
    return apply


for _verb in verbs().values():
    setattr(MeshSet, _verb.name, _method(_verb))
