"""Our filters for MeshLab's users: each verb makes a new layer, by a pipeline."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from ...analysis.segmentation import segment
from ...errors import InvalidParameterError, did_you_mean
from ...io.colors import shades
from ...parameters import Parameters, parameter, problem_with, resolve_length, shown
from ...pipeline import Pipeline, parts
from ...recipes.catalogue import catalogue, known_pipelines, named_pipeline, serves, value_from_text
from ..crosscheck import cross_check
from ..crosscheck.check import MESH_KINDS
from .layers import Layer
from .script import Param

PARTS = ("reducer", "stop")
RICH_TYPES = {"bool": "RichBool", "int": "RichInt", "float": "RichFloat", "length": "RichAbsPerc"}
"""What scripts call the types of parameters; others are words, RichString."""


@dataclass(frozen=True)
class Slot:
    """A parameter of a verb, with the facts that `glsk_o3d.parameters.parameter` makes.

    One of a filter, or of what is inside it, has its name in `Pipeline.with_options` as `option`.
    """

    name: str
    facts: Mapping[str, Any]
    option: str = ""

    @property
    def kind(self) -> str:
        """The type without the mark that it may be None."""
        kind: str = self.facts["type"]
        return kind.rstrip("?")

    def checked(self, value: Any) -> Any:
        """The value as the filter takes it, numbers, reducers and rules made from text; ValueError if it is wrong."""
        value = _plain(value)
        if isinstance(value, str):
            value = value_from_text(value, self.facts, self.option.partition(".")[0])
        if wrong := problem_with(value, self.facts):
            raise ValueError(wrong)
        return value

    def is_of_box(self, value: Any) -> bool:
        """Whether a value is a percentage as MeshLab's are: of the bounding box of the layer."""
        return self.kind == "length" and isinstance(value, str) and value.rstrip().endswith("%")

    def read(self, param: Param) -> Any:
        """The value of a parameter in a script, checked but not resolved; ValueError if it is wrong."""
        try:
            return self.checked(param.text)
        except ValueError as error:
            raise ValueError(f"{error}, not {shown(param.text)}") from None

    def written(self, value: Any) -> Param:
        """The parameter in a script."""
        value = _plain(value)
        if isinstance(value, Parameters | None):
            value = "none" if value is None else type(value).__name__
        text = str(value).lower() if isinstance(value, bool) else value if isinstance(value, str) else repr(value)
        worded = isinstance(value, str) and not self.is_of_box(value)
        kind = "RichMesh" if self.name == "layer" else RICH_TYPES.get(self.kind, "RichString")
        return Param(self.name, "RichString" if worded else kind, {"value": text})


def _plain(value: Any) -> Any:
    """A value without NumPy: a point as text."""
    if isinstance(value, list | tuple) or np.ndim(value):
        return ",".join(map(str, np.ravel(value).tolist()))
    return value.item() if isinstance(value, np.generic | np.ndarray) else value


@dataclass(frozen=True)
class Verb:
    """One of our filters for MeshLab, by its name in Python: a named pipeline, run on the vertices of a layer."""

    name: str
    doc: str
    slots: dict[str, Slot]
    makes: str  # what the result may be, as `layer_endings` has it

    @property
    def title(self) -> str:
        """Its name in scripts, as MeshLab's menus would have it."""
        return f"{self.name.removesuffix('_glsk').replace('_', ' ').title()} (GLSkeleton)"

    @property
    def help(self) -> str:
        """What it does, and what its parameters mean."""
        meanings = [f"{name} : {slot.facts['doc']}" for name, slot in self.slots.items()]
        return "\n".join([self.doc, "", *meanings])

    def plan(self, values: Mapping[str, Any]) -> Pipeline[Any, Any]:
        """The pipeline with such parameters; InvalidParameterError for a name or a value that is wrong.

        So are those of a filter that is not in it.
        """
        checked = {}
        for name, value in values.items():
            if name not in self.slots:
                raise InvalidParameterError(did_you_mean(name, self.slots, f"parameter of {self.name}"))
            try:
                checked[name] = self.slots[name].checked(value)
            except ValueError as error:
                raise InvalidParameterError(f"{name} = {value!r}: {error}") from None
        names = {self.slots[name].option: name for name in checked if self.slots[name].option}
        try:
            start = named_pipeline(checked.get("pipeline", "default"))
            return start.with_options({option: checked[name] for option, name in names.items()})
        except InvalidParameterError as error:  # say it with the name that the verb has for it
            option, colon, why = str(error).partition(": ")
            raise InvalidParameterError(f"{names.get(option, option)}{colon}{why}") from None

    def run(self, layer: Layer, given: Mapping[str, Any], on_iteration: Callable[..., Any] | None = None) -> Layer:
        """The new layer; percentages are of the diagonal of the given layer's bounding box."""
        diagonal = layer.diagonal or 1.0  # one without extent is refused by the Sampler, in better words than a length
        percent = {name: value for name, value in given.items() if self.slots[name].is_of_box(value)}
        pipeline = self.plan({**given, **{name: resolve_length(value, diagonal) for name, value in percent.items()}})
        return self.shown(pipeline(layer.cloud(), on_iteration=on_iteration), layer)

    def shown(self, result: Any, source: Layer) -> Layer:
        """The layer that shows a result."""
        return Layer.of(result, f"{self.title.partition(' (')[0].partition(' ')[2]} of {source.label}", source)


@dataclass(frozen=True)
class SegmentVerb(Verb):
    """Points labelled by the branch of the skeleton that they belong to."""

    def run(self, layer: Layer, given: Mapping[str, Any], on_iteration: Callable[..., Any] | None = None) -> Layer:
        skeleton = layer.skeleton
        if skeleton is not None and len(skeleton.points):
            layer = layer.source or layer
        else:
            skeleton = self.plan(given)(layer.cloud(), on_iteration=on_iteration)
        labels = segment(skeleton)
        colors = shades(skeleton, "branch", labels, skeleton.vertex_of_point)
        return dataclasses.replace(
            self.shown(skeleton.points, layer),
            faces=layer.faces,
            normals=layer.normals,
            scalars=labels.astype(float),
            colors=np.column_stack([colors, np.ones(len(colors))]),
        )


@dataclass(frozen=True)
class CrossCheckVerb(Verb):
    """Points with the angle between both Laplacians, and a verdict on their skeleton."""

    def run(self, layer: Layer, given: Mapping[str, Any], on_iteration: Callable[..., Any] | None = None) -> Layer:
        check = cross_check(layer.cloud(), pipeline=self.plan(given), mesh=given.get("mesh", "auto"))
        results = {"verdict": check.verdict, "probability": check.probability, "because": check.reasons}
        return dataclasses.replace(self.shown(check.points, layer), scalars=check.angle, results=results)


@cache
def verbs() -> dict[str, Verb]:
    """Our filters for MeshLab by their names in Python: the pipelines, the segmentation, and the cross-check."""
    whole = "The curve skeleton of the current layer's vertices, with radii as scalars."
    segmented = (
        "The points that a skeleton was made from, with the branch that each belongs to as scalar and as colour. "
        "On a layer without skeleton the default pipeline makes one first. Faces are kept."
    )
    checked = (
        "Whether the skeleton of the current layer agrees with that of a mesh by libigl's Laplacian: a verdict, and "
        "the points with the angle between both Laplacians in degrees as scalar."
    )
    mesh = Slot("mesh", parameter("auto", "What the mesh is made by.", type="choice", choices=MESH_KINDS).metadata)
    layer = Slot("layer", parameter(None, "The layer to act on; -1 is the current one.", type="int", low=-1).metadata)
    slots = {slot.name: slot for slot in (*_slots_of_all(), layer)}
    of_check = {"pipeline": slots["pipeline"], "mesh": mesh, "layer": layer}
    known = [
        Verb("generate_curve_skeleton_glsk", whole, slots, "a skeleton"),
        SegmentVerb("generate_segmented_cloud_glsk", segmented, {"layer": layer}, "points or a mesh"),
        CrossCheckVerb("get_curve_skeleton_crosscheck_glsk", checked, of_check, "points"),
    ]
    return {verb.name: verb for verb in known}


def _slots_of_all() -> list[Slot]:
    """The name of a pipeline, and the parameters of all filters that are in one, or may be."""
    about = "The named pipeline; parameters that are not given are as it has them."
    choice = parameter(None, about, type="choice", choices=tuple(known_pipelines())).metadata
    inside = [type(part) for make in known_pipelines().values() for part in parts(make())]
    inside += [cls for cls in catalogue().values() if any(serves(cls, kind) for kind in PARTS)]
    prefixed = (
        Slot(f"{cls.__name__.lower()}_{field.name}", field.metadata, f"{cls.__name__}.{field.name}")
        for cls in dict.fromkeys(inside)
        for field in dataclasses.fields(cls)  # type: ignore[arg-type]
    )
    return [Slot("pipeline", choice), *prefixed]
