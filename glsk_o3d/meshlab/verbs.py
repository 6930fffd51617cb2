"""Our filters as MeshLab's users meet them: verbs that make a new layer from the current one.

Everything is generated from the catalogue: every filter there is has a verb, with its parameters as they describe
themselves.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import chain
from typing import Any, ClassVar

import numpy as np

from ..contractor import Contractor
from ..errors import InvalidCloudError, InvalidParameterError, did_you_mean
from ..interop.clouds import Cloud
from ..io.colors import shades
from ..lpr_reducer import LPRReducer
from ..parameters import Parameters, parameter, problem_with
from ..pipeline import Filter, Pipeline, parts
from ..recipes.catalogue import catalogue, known_pipelines, named_pipeline, serves
from ..ring_builder import RingBuilder
from ..skeleton import Skeleton
from ..state import Contraction
from .layers import Layer
from .script import FLOAT, LENGTH, Param

_NAMES = {
    "RingBuilder": "generate_one_rings",
    "Contractor": "generate_contracted_cloud",
    "LPRReducer": "generate_reduced_cloud",
    "Connector": "generate_skeleton_graph",
    "Refiner": "generate_refined_skeleton",
}
_WHOLE, _SEGMENTED = "generate_curve_skeleton", "generate_segmented_cloud"
_PARTS = ("reducer", "stop")


@dataclass(frozen=True)
class Slot:
    """A parameter of a verb: one of a filter's or of what is inside it, or one of the verb's own.

    Attributes
    ----------
    name : str
    facts : mapping
        As `glsk_o3d.parameters.parameter` makes it.
    owner : subclass of Parameters, or None for the verb's own
    field : str
    default : object
        Of the verb's own; those of filters are as the pipeline has them.
    """

    name: str
    facts: Mapping[str, Any]
    owner: type[Parameters] | None = None
    field: str = ""
    default: Any = None

    @property
    def kind(self) -> str:
        """The type of the parameter, without the mark that it may be None."""
        return self.facts["type"].rstrip("?")

    @property
    def words(self) -> tuple[str, ...]:
        """What it may be in words."""
        words = self.facts["choices"]
        if self.kind in _PARTS:
            words = [name for name, cls in catalogue().items() if cls is not self.owner and serves(cls, self.kind)]
        return (*words, *["none"] * self.facts["type"].endswith("?"))

    @property
    def types(self) -> tuple[str, ...]:
        """The types that it may have in a script; the first is written."""
        worded = {"choice": ("RichEnum",), **dict.fromkeys(_PARTS, ())}
        if self.kind in worded:
            return ("RichString", *worded[self.kind])
        if self.name == "layer":
            return ("RichMesh", "RichInt")
        plain = {"bool": ("RichBool",), "int": ("RichInt",), "float": FLOAT, "length": LENGTH}[self.kind]
        return (*plain, "RichString") if self.words else plain

    def python_type(self) -> str:
        """Its type as MeshLab's listings print it."""
        name = {"length": "PercentageValue", "choice": "str", **dict.fromkeys(_PARTS, "str")}.get(self.kind, self.kind)
        return f"{name} or str" if self.words and name != "str" else name

    def checked(self, value: Any) -> Any:
        """The value as the filter takes it, reducers and rules made from their names.

        Raises
        ------
        ValueError
        """
        if isinstance(value, np.generic):
            value = value.item()
        if value == "none" and "none" in self.words:
            return None
        if self.kind == "choice" and type(value) is int:
            if not 0 <= value < len(self.words):
                raise ValueError(f"must be one of {', '.join(map(repr, self.words))}, or its number from 0")
            value = self.words[value]
        if self.kind in _PARTS and isinstance(value, str):
            if value not in self.words:
                raise ValueError(did_you_mean(value, self.words, self.kind))
            return catalogue()[value]()
        wrong = problem_with(value, self.facts)
        if wrong:
            raise ValueError(wrong)
        return value

    def read(self, param: Param) -> Any:
        """The value of a parameter in a script, checked but not resolved.

        Raises
        ------
        ValueError
        """
        param.check_type(self.types)
        value = param.value()
        self.checked(value)
        return value

    def written(self, value: Any) -> Param:
        """The inverse of `read`."""
        kind = self.types[0]
        if isinstance(value, Parameters | None):
            value, kind = "none" if value is None else type(value).__name__, "RichString"
        elif isinstance(value, str) and self.kind == "int":
            kind = "RichString"
        text = str(value).lower() if isinstance(value, bool) else value if isinstance(value, str) else repr(value)
        return Param(self.name, kind, {"value": text})


@dataclass(frozen=True)
class Verb:
    """One of our filters for MeshLab.

    Attributes
    ----------
    name : str
        In Python: ``"generate_curve_skeleton_glsk"``.
    title : str
        In scripts: ``"Generate Curve Skeleton (GLSkeleton)"``.
    doc : str
    slots : dict of str to Slot
    """

    name: str
    title: str
    doc: str
    slots: dict[str, Slot]

    default: ClassVar[str] = "default"

    @property
    def makes(self) -> str:
        """What the result may be, as `check_ending` has it."""
        return "skeleton"

    def start(self, values: Mapping[str, Any]) -> Pipeline:
        """The pipeline whose parameters the values change."""
        return named_pipeline(values.get("pipeline", self.default))

    def plan(self, values: Mapping[str, Any]) -> Pipeline:
        """The filters that the verb runs with such parameters, checked.

        Parameters
        ----------
        values : mapping of str to object

        Returns
        -------
        Pipeline

        Raises
        ------
        InvalidParameterError
            An unknown parameter (the message names the nearest), one of something that is not in the pipeline, or a
            value of the wrong type or out of range.
        """
        made = {}
        for name, value in values.items():
            if name not in self.slots:
                raise InvalidParameterError(did_you_mean(name, self.slots, f"parameter of {self.name}"))
            try:
                made[name] = self.slots[name].checked(value)
            except ValueError as error:
                raise InvalidParameterError(f"{name} = {value!r}: {error}") from None
        options = {
            f"{slot.owner.__name__}.{slot.field}": name for name in made if (slot := self.slots[name]).owner is not None
        }
        try:
            return self.start(made).with_options({option: made[name] for option, name in options.items()})
        except InvalidParameterError as error:  # say it with the name that the verb has for it
            option, colon, why = str(error).partition(": ")
            raise InvalidParameterError(f"{options.get(option, option)}{colon}{why}") from None

    def values(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """All parameters that matter, the given ones and the defaults of the others.

        Parameters
        ----------
        given : mapping of str to object

        Returns
        -------
        dict of str to object
        """
        pipeline = self.plan(given)
        found: dict[str, Any] = {}
        for slot in self.slots.values():
            if slot.owner is None:
                found[slot.name] = given.get(slot.name, slot.default)
            for part in parts(pipeline):
                if type(part) is slot.owner:
                    value = getattr(part, slot.field)
                    found[slot.name] = slot.written(value).attributes["value"] if slot.kind in _PARTS else value
        return found

    def run(self, layer: Layer, given: Mapping[str, Any], on_iteration: Callable[..., Any] | None = None) -> Layer:
        """Run on a layer.

        Parameters
        ----------
        layer : Layer
            A cloud, a mesh (its vertices are the cloud), or what another of our filters made.
        given : mapping of str to object
            Parameters that differ from the defaults.
        on_iteration : callable, optional
            As in `glsk_o3d.skeletonize`.

        Returns
        -------
        Layer

        Raises
        ------
        InvalidParameterError, InvalidCloudError
        """
        pipeline = self.plan(given)
        return self.shown(pipeline(_cloud(layer), on_iteration=on_iteration), layer)

    def shown(self, result: Any, source: Layer) -> Layer:
        """The layer that shows a result."""
        return Layer.of(result, f"{self.title.partition(' (')[0].partition(' ')[2]} of {source.label}", source)


@dataclass(frozen=True)
class FilterVerb(Verb):
    """One filter of a pipeline. What must run before it runs first, unless the layer comes from there."""

    filter: type[Filter]

    @property
    def makes(self):
        return "skeleton" if self.filter.produces is Skeleton else "points"

    def start(self, values):
        found = [stage for stage in named_pipeline(self.default).stages if type(stage) is self.filter]
        return Pipeline(*(found or [self.filter()]))

    def run(self, layer, given, on_iteration=None):
        pipeline = self.plan(given)
        if self.filter.consumes is not Cloud and isinstance(layer.flow, self.filter.consumes):
            return self.shown(pipeline(layer.flow, on_iteration=on_iteration), _plain(layer))
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
        if self.filter is LPRReducer:  # a reduction is seen best where the points were
            kept = result.point_of_survivor
            hung = {name: getattr(source, name) for name in ("normals", "colors")}
            hung = {name: array[kept] for name, array in hung.items() if array is not None}
            return dataclasses.replace(layer, vertices=result.points[kept], **hung)
        return layer


@dataclass(frozen=True)
class SegmentVerb(Verb):
    """Points labelled by the branch of the skeleton that they belong to."""

    @property
    def makes(self):
        return "points or mesh"

    def run(self, layer, given, on_iteration=None):
        pipeline = self.plan(given)
        if isinstance(layer.flow, Skeleton):
            skeleton, layer = layer.flow, _plain(layer)
        else:
            skeleton = pipeline(_cloud(layer), on_iteration=on_iteration)
        labels = skeleton.segment()
        colors = shades(skeleton, "branch", labels, skeleton.vertex_of_point)
        return dataclasses.replace(
            self.shown(skeleton.points, layer),
            faces=layer.faces,
            normals=layer.normals,
            scalars=labels.astype(float),
            colors=np.column_stack([colors, np.ones(len(colors))]),
        )


def facts(layer: Layer) -> dict[str, Any]:
    """A result in a few numbers, as MeshLab's filters return them.

    Parameters
    ----------
    layer : Layer

    Returns
    -------
    dict of str to int, float, bool or str
    """
    found: dict[str, Any] = {"vertices": len(layer.vertices)}
    flow = layer.flow
    if isinstance(flow, Skeleton):
        found |= {"edges": len(flow.edges), "components": flow.n_components, "loops": flow.n_loops}
        found |= {"length": flow.length}
    elif layer.colors is not None and layer.scalars is not None:
        found["branches"] = int(layer.scalars.max(initial=-1)) + 1
    if flow is not None:
        report = flow.report
        found |= {"iterations": len(report.iterations), "converged": report.converged}
        found |= {"stop_reason": report.stop_reason, "warnings": list(report.warnings)}
    return found


@cache
def verbs() -> dict[str, Verb]:
    """Our filters for MeshLab by their names in Python.

    Returns
    -------
    dict of str to Verb
        The whole pipeline first, then each filter of the catalogue, then the segmentation.
    """
    known = catalogue()
    whole = {type(part): None for make in known_pipelines().values() for part in parts(make())}
    whole |= {cls: None for cls in known.values() if any(serves(cls, kind) for kind in _PARTS)}
    about = "The named pipeline; parameters that are not given are as it has them."
    choice = _facts(about, "choice", tuple(known_pipelines()))
    slots = [Slot("pipeline", choice, default=Verb.default), *chain.from_iterable(_slots(cls) for cls in whole)]
    found = [
        Verb(
            *_called(_WHOLE),
            "The curve skeleton of the current layer's vertices, with radii as scalars.",
            {slot.name: slot for slot in slots},
        )
    ]
    for name, cls in known.items():
        if issubclass(cls, Filter):
            own = {slot.field: dataclasses.replace(slot, name=slot.field) for slot in _slots(cls)}
            kinds = {slot.kind for slot in own.values()} & set(_PARTS)
            inside = [part for part in known.values() if part is not cls and any(serves(part, kind) for kind in kinds)]
            own |= {slot.name: slot for part in inside for slot in _slots(part)}
            words = "_".join(re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z0-9]*", name)).lower()
            doc = (cls.__doc__ or name).partition("\n\n")[0].replace("\n", " ")
            found.append(FilterVerb(*_called(_NAMES.get(name, f"generate_by_{words}")), doc, own, cls))
    found.append(
        SegmentVerb(
            *_called(_SEGMENTED),
            "The points that a skeleton was made from, with the branch that each belongs to as scalar and as colour. "
            "On a layer without skeleton the default pipeline makes one first. Faces are kept.",
            {},
        )
    )
    layer = Slot("layer", _facts("The layer to act on; -1 is the current one.", "int", low=-1), default=-1)
    return {verb.name: dataclasses.replace(verb, slots={**verb.slots, layer.name: layer}) for verb in found}


def _facts(doc, type, choices=(), low=None):
    return parameter(None, doc, type=type, choices=choices, low=low).metadata


def _called(stem: str) -> tuple[str, str]:
    return f"{stem}_glsk", f"{stem.replace('_', ' ').title()} (GLSkeleton)"


def _slots(cls: type[Parameters]) -> Iterator[Slot]:
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        yield Slot(f"{cls.__name__.lower()}_{field.name}", field.metadata, cls, field.name)


def _plain(layer: Layer) -> Layer:
    """The cloud or mesh that a layer was made from."""
    return layer.source or layer


def _cloud(layer: Layer) -> np.ndarray:
    if layer.edges is not None and layer.faces is None:
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
