"""Our filters for MeshLab's users: each verb makes a new layer, by a pipeline or an edit of a skeleton."""

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from .. import editing
from ..analysis.segmentation import segment
from ..errors import InvalidCloudError, InvalidParameterError, did_you_mean
from ..io.colors import shades
from ..io.formats.graphs import graph_skeleton
from ..numerics.vectors import AXES
from ..parameters import Parameters, parameter, problem_with, resolve_length, shown
from ..pipeline import Pipeline, parts
from ..recipes.catalogue import catalogue, known_pipelines, named_pipeline, serves
from .layers import Layer
from .script import Param

PARTS = ("reducer", "stop")
OF_FRAME = " of the frame"
"""What follows a percentage that is as everywhere else in this package, of the box that the Sampler's `frame` names."""
RICH_TYPES = {"bool": "RichBool", "int": "RichInt", "float": "RichFloat", "length": "RichAbsPerc"}
"""What scripts call the types of parameters; others are words, RichString."""


def facts_of(doc: str, type: str, choices: tuple[str, ...] = (), low: float | None = None) -> Mapping[str, Any]:
    """The facts of a parameter that is no filter's."""
    return parameter(None, doc, type=type, choices=choices, low=low).metadata


_EDITS: dict[str, Callable[..., Any]] = {
    "generate_largest_skeleton_component": editing.largest_component,
    "generate_skeleton_without_loops": editing.cut_loops,
    "generate_rerooted_skeleton": editing.reroot,
    "generate_pruned_skeleton": editing.prune,
    "generate_simplified_skeleton": editing.simplify,
}
_ROOT = "Where the tree grows from: the lowest vertex along an axis, the thickest end, a vertex, or a point."
_EDIT_PARAMETERS = {
    "length": facts_of("Least length of a branch that ends, from junction to tip.", "length", low=0),
    "order": facts_of("Highest order of branches that stays: 0 for the stem alone.", "int?", low=0),
    "tolerance": facts_of("How far a dropped vertex may be from the simpler curve.", "length", low=0),
}


@dataclass(frozen=True)
class Slot:
    """A parameter of a verb, with the facts that `glsk_o3d.parameters.parameter` makes.

    One of a filter, or of what is inside it, has its name in `Pipeline.with_options` as `option`, and its default from
    the pipeline; the verb's own have a default here.
    """

    name: str
    facts: Mapping[str, Any]
    option: str = ""
    default: Any = None

    @property
    def kind(self) -> str:
        """The type without the mark that it may be None; "root" for a point that may be a vertex by its number."""
        kind = self.facts["type"].rstrip("?")
        return "root" if kind == "point" and not self.option else kind

    @property
    def words(self) -> tuple[str, ...]:
        """What it may be in words."""
        words = self.facts["choices"]
        if self.kind in PARTS:
            serving = [name for name, cls in catalogue().items() if serves(cls, self.kind)]
            words = [name for name in serving if name != self.option.partition(".")[0]]
        return (*words, *["none"] * self.facts["type"].endswith("?"))

    def checked(self, value: Any) -> Any:
        """The value as the filter takes it, reducers and rules made from their names; ValueError if it is wrong."""
        value = _plain(value)
        if value == "none" and "none" in self.words:
            return None
        if self.kind == "length" and self.option and isinstance(value, str):  # filters alone know the frame
            value = value.removesuffix(OF_FRAME)
        if self.kind == "choice" and type(value) is int and 0 <= value < len(self.words):
            value = self.words[value]
        if self.kind in PARTS and isinstance(value, str):
            if value not in self.words:
                raise ValueError(did_you_mean(value, self.words, self.kind))
            return catalogue()[value]()
        if self.kind == "root" and str(value).isdecimal():
            return int(value)
        wrong = problem_with(value, self.facts)
        if wrong:
            raise ValueError(wrong + ", or the number of a vertex" * (self.kind == "root"))
        return value

    def is_of_box(self, value: Any) -> bool:
        """Whether a value is a percentage as MeshLab's are: of the bounding box of the layer."""
        return self.kind == "length" and isinstance(value, str) and value.rstrip().endswith("%")

    def read(self, param: Param) -> Any:
        """The value of a parameter in a script, checked but not resolved; ValueError if it is wrong."""
        value: Any = param.text
        if self.kind == "bool":
            value = {"true": True, "false": False}.get(value.lower(), value)
        elif self.kind != "root":
            for number in (int, float) if self.kind in ("float", "length") else (int,):
                with suppress(ValueError):
                    value = number(param.text)
                    break
        try:
            self.checked(value)
        except ValueError as error:
            raise ValueError(f"{error}, not {shown(value)}") from None
        return value

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
    """One of our filters for MeshLab, by its name in Python and its title in scripts."""

    name: str
    title: str
    doc: str
    slots: dict[str, Slot]
    makes: str  # what the result may be, as `check_ending` has it

    @property
    def help(self) -> str:
        """What it does, and what its parameters mean."""
        meanings = [f"{name} : {slot.facts['doc']}" for name, slot in self.slots.items()]
        return "\n".join([self.doc, "", *meanings])

    def checked(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """The given parameters as they are taken; InvalidParameterError for a name or a value that is wrong."""
        made = {}
        for name, value in values.items():
            if name not in self.slots:
                raise InvalidParameterError(did_you_mean(name, self.slots, f"parameter of {self.name}"))
            try:
                made[name] = self.slots[name].checked(value)
            except ValueError as error:
                raise InvalidParameterError(f"{name} = {value!r}: {error}") from None
        return made

    def in_units(self, values: Mapping[str, Any], diagonal: float) -> dict[str, Any]:
        """Parameters with lengths in place of the percentages of a layer's diagonal."""
        percent = {name: value for name, value in values.items() if self.slots[name].is_of_box(value)}
        return {**values, **{name: resolve_length(value, diagonal) for name, value in percent.items()}}

    def plan(self, values: Mapping[str, Any]) -> Any:
        """What the verb does with such parameters, all checked; two of the same are equal."""
        raise NotImplementedError

    def run(self, layer: Layer, given: Mapping[str, Any], on_iteration: Callable[..., Any] | None = None) -> Layer:
        """The new layer; percentages are of the diagonal of the given layer's bounding box."""
        raise NotImplementedError

    def shown(self, result: Any, source: Layer) -> Layer:
        """The layer that shows a result."""
        return Layer.of(result, f"{self.title.partition(' (')[0].partition(' ')[2]} of {source.label}", source)


@dataclass(frozen=True)
class PipelineVerb(Verb):
    """A named pipeline, run on the vertices of a layer: a cloud or a mesh."""

    def plan(self, values: Mapping[str, Any]) -> Pipeline:
        """The pipeline with such parameters; refuses those of a filter that is not in it."""
        made = self.checked(values)
        names = {self.slots[name].option: name for name in made if self.slots[name].option}
        try:
            start = named_pipeline(made.get("pipeline", "default"))
            return start.with_options({option: made[name] for option, name in names.items()})
        except InvalidParameterError as error:  # say it with the name that the verb has for it
            option, colon, why = str(error).partition(": ")
            raise InvalidParameterError(f"{names.get(option, option)}{colon}{why}") from None

    def run(self, layer, given, on_iteration=None):
        # a layer without extent is refused by the Sampler, in better words than a length of 0
        pipeline = self.plan(self.in_units(given, layer.diagonal or 1.0))
        return self.shown(pipeline(layer.cloud(), on_iteration=on_iteration), layer)


@dataclass(frozen=True)
class SegmentVerb(PipelineVerb):
    """Points labelled by the branch of the skeleton that they belong to."""

    def run(self, layer, given, on_iteration=None):
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
class EditVerb(Verb):
    """A skeleton changed by a function of `glsk_o3d.editing`, with the names and defaults of its parameters."""

    function: Callable[..., Any]

    def plan(self, values):
        defaults = {name: slot.default for name, slot in self.slots.items()}
        made = {**defaults, **self.checked(values)}
        del made["layer"]
        # tried on a line, since the function knows best what goes together; which vertices there are nobody knows yet
        line = graph_skeleton(np.eye(2, 3), [[0, 1]], np.ones(2))
        self.function(line, **self.in_units({name: value for name, value in made.items() if name != "root"}, 1.0))
        return made

    def run(self, layer, given, on_iteration=None):
        made = self.plan(given)
        if not layer.is_skeleton:
            cure = "make one with generate_curve_skeleton_glsk, or name its layer"
            raise InvalidCloudError(f"the layer ({layer.label}) is no skeleton: {cure}")
        try:
            found = self.function(layer.to_skeleton(), **self.in_units(made, layer.diagonal))
        except InvalidParameterError as error:
            cure = "cut them with generate_skeleton_without_loops_glsk"
            raise InvalidParameterError(str(error).replace("see cut_loops (--cut-loops)", cure)) from None
        skeleton, *cut = found if isinstance(found, tuple) else (found,)
        shown = self.shown(skeleton, layer.source or layer)
        return dataclasses.replace(shown, cut=cut[0].mean(axis=1).tolist()) if cut else shown


@cache
def verbs() -> dict[str, Verb]:
    """Our filters for MeshLab by their names in Python: the pipelines, the segmentation, and what changes skeletons."""
    whole = "The curve skeleton of the current layer's vertices, with radii as scalars."
    segmented = (
        "The points that a skeleton was made from, with the branch that each belongs to as scalar and as colour. "
        "On a layer without skeleton the default pipeline makes one first. Faces are kept."
    )
    found = [
        _verb(PipelineVerb, "generate_curve_skeleton", whole, _slots_of_all(), "skeleton"),
        _verb(SegmentVerb, "generate_segmented_cloud", segmented, [], "points or mesh"),
        *(_edit_verb(stem, function) for stem, function in _EDITS.items()),
    ]
    return {verb.name: verb for verb in found}


def _verb(kind: type[Verb], stem: str, doc: str, slots: list[Slot], makes: str, *more: Any) -> Verb:
    layer = Slot("layer", facts_of("The layer to act on; -1 is the current one.", "int", low=-1), default=-1)
    title = f"{stem.replace('_', ' ').title()} (GLSkeleton)"
    return kind(f"{stem}_glsk", title, doc, {slot.name: slot for slot in (*slots, layer)}, makes, *more)


def _slots_of_all() -> list[Slot]:
    """The name of a pipeline, and the parameters of all filters that are in one, or may be."""
    about = "The named pipeline; parameters that are not given are as it has them."
    choice = facts_of(about, "choice", tuple(known_pipelines()))
    inside = [type(part) for make in known_pipelines().values() for part in parts(make())]
    inside += [cls for cls in catalogue().values() if any(serves(cls, kind) for kind in PARTS)]
    prefixed = (
        Slot(f"{cls.__name__.lower()}_{field.name}", field.metadata, f"{cls.__name__}.{field.name}")
        for cls in dict.fromkeys(inside)
        for field in dataclasses.fields(cls)  # type: ignore[arg-type]
    )
    return [Slot("pipeline", choice, default="default"), *prefixed]


def _edit_verb(stem: str, function: Callable[..., Any]) -> Verb:
    slots = []
    for each in list(inspect.signature(function).parameters.values())[1:]:  # the first is the skeleton
        root = facts_of(_ROOT, "point?" if each.default is None else "point", (*AXES, "thickest"))
        slots.append(Slot(each.name, _EDIT_PARAMETERS.get(each.name, root), default=each.default))
    return _verb(EditVerb, stem, _summary(function).replace("`", ""), slots, "skeleton", function)


def _summary(thing: Any) -> str:
    return (inspect.getdoc(thing) or "").partition("\n\n")[0].replace("\n", " ")
