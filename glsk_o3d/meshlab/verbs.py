"""Our filters as MeshLab's users meet them: a verb for every filter of the catalogue, which makes a new layer."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np

from ..analysis.segmentation import segment
from ..contractor import Contractor
from ..errors import InvalidCloudError, InvalidParameterError
from ..interop.clouds import Cloud
from ..io.colors import shades
from ..lpr_reducer import LPRReducer
from ..parameters import Parameters, resolve_length
from ..pipeline import Filter, Pipeline, parts
from ..recipes.catalogue import catalogue, known_pipelines, named_pipeline, serves
from ..ring_builder import RingBuilder
from ..skeleton import Skeleton
from ..state import Contraction
from .edits import edits
from .layers import Layer
from .verb import OF_FRAME, PARTS, Slot, Verb, called, facts_of

_NAMES = {
    "RingBuilder": "generate_one_rings",
    "Contractor": "generate_contracted_cloud",
    "LPRReducer": "generate_reduced_cloud",
    "Connector": "generate_skeleton_graph",
    "Refiner": "generate_refined_skeleton",
}


@dataclass(frozen=True)
class PipelineVerb(Verb):
    """A pipeline of filters, run on the vertices of a layer: a cloud, a mesh, or what a filter of ours made."""

    default: ClassVar[str] = "default"

    def start(self, values: Mapping[str, Any]) -> Pipeline:
        """The pipeline whose parameters the values change."""
        return named_pipeline(values.get("pipeline", self.default))

    def plan(self, values: Mapping[str, Any]) -> Pipeline:
        """The filters that the verb runs with such parameters; refuses those of a filter that is not among them."""
        made = self.checked(values)
        names = {self.slots[name].option: name for name in made if self.slots[name].option}
        try:
            return self.start(made).with_options({option: made[name] for option, name in names.items()})
        except InvalidParameterError as error:  # say it with the name that the verb has for it
            option, colon, why = str(error).partition(": ")
            raise InvalidParameterError(f"{names.get(option, option)}{colon}{why}") from None

    def values(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """As of every verb. A percentage that was not given says that it is the filter's: ``"1% of the frame"``."""
        own, found = super().values(given), {}
        present = {type(part).__name__: part for part in parts(self.plan(given))}
        for slot in self.slots.values():
            holder, _, field = slot.option.partition(".")
            if not holder:
                found[slot.name] = own[slot.name]
            elif holder in present:
                value = getattr(present[holder], field)
                if slot.is_of_box(value) and not slot.is_of_box(given.get(slot.name)):
                    value += OF_FRAME
                found[slot.name] = slot.written(value).attributes["value"] if slot.kind in PARTS else value
        return found

    def plan_for(self, layer: Layer, given: Mapping[str, Any]) -> Pipeline:
        """As `plan`; percentages are lengths: of the diagonal of the layer's bounding box."""
        pipeline, diagonal = self.plan(given), layer.diagonal
        percent = {name: value for name, value in given.items() if self.slots[name].is_of_box(value)}
        if not (percent and diagonal):  # a layer without extent is refused in better words
            return pipeline
        return self.plan({**given, **{name: resolve_length(value, diagonal) for name, value in percent.items()}})

    def run(self, layer, given, on_iteration=None):
        return self.shown(self.plan_for(layer, given)(_cloud(layer), on_iteration=on_iteration), layer)


@dataclass(frozen=True)
class FilterVerb(PipelineVerb):
    """One filter of a pipeline. What must run before it runs first, unless the layer comes from there."""

    filter: type[Filter]

    @property
    def makes(self):
        return "skeleton" if self.filter.produces is Skeleton else "points"

    def start(self, values):
        found = [stage for stage in named_pipeline(self.default).stages if type(stage) is self.filter]
        return Pipeline(*(found or [self.filter()]))

    def run(self, layer, given, on_iteration=None):
        pipeline = self.plan_for(layer, given)
        if _goes_on(layer, self.filter.consumes):
            return self.shown(pipeline(layer.flow, on_iteration=on_iteration), layer.source or layer)
        pipeline = Pipeline(*self.before(), *pipeline.stages)
        return self.shown(pipeline(_cloud(layer), on_iteration=on_iteration), layer)

    def before(self) -> tuple[Filter, ...]:
        """What turns a cloud into what the filter takes: the default pipeline's filters before it."""
        stages = named_pipeline(self.default).stages
        kinds = [type(stage) for stage in stages]
        if self.filter in kinds:
            return stages[: kinds.index(self.filter)]
        if self.filter.consumes is Contraction:
            return (RingBuilder(thin_to="all"), Contractor(max_iterations=1))
        return stages if self.filter.consumes is Skeleton else ()

    def shown(self, result, source):
        layer = super().shown(result, source)
        if self.filter is not LPRReducer:
            return layer
        kept = result.point_of_survivor  # a reduction is seen best where the points were
        normals, colors = (None if each is None else each[kept] for each in (source.normals, source.colors))
        return dataclasses.replace(layer, vertices=result.points[kept], normals=normals, colors=colors)


@dataclass(frozen=True)
class SegmentVerb(PipelineVerb):
    """Points labelled by the branch of the skeleton that they belong to."""

    @property
    def makes(self):
        return "points or mesh"

    def run(self, layer, given, on_iteration=None):
        pipeline = self.plan_for(layer, given)
        if _goes_on(layer, Skeleton):
            skeleton, layer = layer.flow, layer.source or layer
        else:
            skeleton = pipeline(_cloud(layer), on_iteration=on_iteration)
        labels = segment(skeleton)
        colors = shades(skeleton, "branch", labels, skeleton.vertex_of_point)
        return dataclasses.replace(
            self.shown(skeleton.points, layer),
            faces=layer.faces,
            normals=layer.normals,
            scalars=labels.astype(float),
            colors=np.column_stack([colors, np.ones(len(colors))]),
        )


@cache
def verbs() -> dict[str, Verb]:
    """Our filters for MeshLab by their names in Python.

    The whole pipeline first, then each filter of the catalogue, the segmentation, and what changes skeletons.
    """
    segmented = SegmentVerb(
        *called("generate_segmented_cloud"),
        "The points that a skeleton was made from, with the branch that each belongs to as scalar and as colour. "
        "On a layer without skeleton the default pipeline makes one first. Faces are kept.",
        {},
    )
    filters = [_filter_verb(cls) for cls in catalogue().values() if issubclass(cls, Filter)]
    layer = Slot("layer", facts_of("The layer to act on; -1 is the current one.", "int", low=-1), default=-1)
    return {
        verb.name: dataclasses.replace(verb, slots={**verb.slots, layer.name: layer})
        for verb in (_whole_verb(), *filters, segmented, *edits())
    }


def _whole_verb() -> PipelineVerb:
    """The verb of a whole pipeline, which has the parameters of all its filters."""
    about = "The named pipeline; parameters that are not given are as it has them."
    choice = facts_of(about, "choice", tuple(known_pipelines()))
    inside = [type(part) for make in known_pipelines().values() for part in parts(make())]
    inside += [cls for cls in catalogue().values() if any(serves(cls, kind) for kind in PARTS)]
    slots = [Slot("pipeline", choice, default=PipelineVerb.default)]
    slots += [slot for cls in dict.fromkeys(inside) for slot in _slots(cls, f"{cls.__name__.lower()}_")]
    doc = "The curve skeleton of the current layer's vertices, with radii as scalars."
    return PipelineVerb(*called("generate_curve_skeleton"), doc, {slot.name: slot for slot in slots})


def _filter_verb(cls: type[Filter]) -> FilterVerb:
    """The verb of a filter, which has its parameters and those of what may be inside it."""
    slots = list(_slots(cls))
    kinds = {slot.kind for slot in slots} & set(PARTS)
    for part in catalogue().values():
        if part is not cls and any(serves(part, kind) for kind in kinds):
            slots += _slots(part, f"{part.__name__.lower()}_")
    words = "_".join(re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z0-9]*", cls.__name__)).lower()
    doc = (cls.__doc__ or cls.__name__).partition("\n\n")[0].replace("\n", " ")
    stem = _NAMES.get(cls.__name__, f"generate_by_{words}")
    return FilterVerb(*called(stem), doc, {slot.name: slot for slot in slots}, cls)


def _slots(cls: type[Parameters], prefix: str = "") -> Iterator[Slot]:
    """A slot for each parameter of a filter, reducer or rule."""
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        yield Slot(prefix + field.name, field.metadata, f"{cls.__name__}.{field.name}")


def _goes_on(layer: Layer, kind: type) -> bool:
    """Whether a layer holds what a filter takes, with the points that it is of: those of a file have none."""
    flow = layer.flow
    return flow is not None and kind is not Cloud and isinstance(flow, kind) and len(flow.points) > 0


def _cloud(layer: Layer) -> np.ndarray:
    """The vertices of a layer that is a scan; InvalidCloudError for a skeleton and a contracted cloud."""
    if layer.is_skeleton:
        raise InvalidCloudError(
            f"the current layer ({layer.label}) is a skeleton or another line drawing: make the scan the current layer"
        )
    flow = layer.flow
    if isinstance(flow, Contraction) and flow.report.iterations and np.array_equal(layer.vertices, flow.contracted):
        raise InvalidCloudError(
            f"the current layer ({layer.label}) is contracted and no scan: make the scan the current layer, or go on "
            "with generate_skeleton_graph_glsk"
        )
    return layer.vertices
