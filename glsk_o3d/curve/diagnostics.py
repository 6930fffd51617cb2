"""Warnings about places without a meaningful curve skeleton: sheets, balls, and points that do not determine it."""

from dataclasses import dataclass

import numpy as np

from ..data.decisions import coordinates
from ..data.verdict import Reason
from ..geometry.groups import component_labels, group_median, group_sum
from ..geometry.numbers import precision, warning
from ..geometry.vectors import dot, norm
from .curve import Curve
from .numbers import CURVE


@dataclass(frozen=True)
class WarningNumbers:
    """Numbers of the warnings."""

    ball_spread: float = warning(
        0.5, "spread of normal lines around where they meet, over the radius: ball 0, torus .65, tube 1"
    )
    regular: float = precision(1e-9, "weight of the first vertex, per point, where normals do not say where they meet")
    low_confidence: float = warning(0.1, "confidence below which a vertex is not to be trusted")
    low_share: float = warning(0.25, "share of the points around such vertices that is worth a warning")
    opened: float = warning(0.1, "opened loops that are handles, over the ends: trees have .02, rings and frames .25")


WARN = WarningNumbers()


DIAGNOSES = ("sheet", "sphere", "no edges", "close call", "weak region", "opened loops")
"""The codes of the reasons that `diagnose` gives."""


def measured(curve: Curve) -> Curve:
    """A finished curve with its sections, and with the reasons not to trust it.

    They take the place of those of before, and follow what other filters said.
    """
    sections = curve.sections
    curve = curve.changed(half_width=sections.half_width, half_thickness=sections.half_thickness)
    others = [reason for reason in curve.report.reasons if reason.code not in DIAGNOSES]
    return curve.with_facts(reasons=(*others, *diagnose(curve)))


def diagnose(curve: Curve) -> list[Reason]:
    """Reasons not to trust a curve: the cloud is sheet-like, sphere-like, or does not say where much of the axis is.

    Sheet-like: the normals around a vertex have one direction, and it has little confidence, unlike a blade, which has
    two sides; or it is of a component whose curve is hardly longer than the part is wide: a coin, a plate. Sphere-like:
    the normal lines of a whole component meet in one point, or it is hardly longer than thick. All are scale-free. Of a
    cloud that is neither, the parts with little confidence are named, and the least certain question about loops, air
    and gaps. No edges at all are a reason, too, and a tree made of what has loops.
    """
    if len(curve.cloud.rows) == 0:
        return []
    reason = _sheet(curve) or _ball(curve) or _stubs(curve)
    if reason:
        return [reason]
    if len(curve.edges) == 0:
        text = "no edges: every part became one vertex; is Connector.radius larger than the parts are long?"
        return [Reason("no edges", text)]
    return _weak_region(curve) + _close_calls(curve) + _opened_loops(curve)


def _sheet(curve: Curve) -> Reason | None:
    """Most of the surface faces one direction."""
    cloud, part, n = curve.cloud, curve.component_of_vertex, curve.n_components
    along = np.einsum("ni,nj->nij", cloud.normals, cloud.normals)
    spread = np.linalg.eigvalsh(group_sum(along, cloud.vertex, len(part)))
    one_way = spread[:, 2] > CURVE.sheet * np.maximum(cloud.count, 1)
    length = np.bincount(part[curve.edges[:, 0]], curve.edge_lengths, n)
    stub = length < CURVE.stub * group_median(curve.half_width[cloud.vertex], part[cloud.vertex], n)
    flat = one_way & (~(curve.confidence >= WARN.low_confidence) | stub[part])
    share = float(cloud.count[flat].sum() / len(cloud.vertex))
    text = (
        f"sheet-like: around {share:.0%} of the points the surface faces one direction only, as that of a plate or a "
        "pan, so a curve skeleton has little meaning; if that is a table or a floor under an object, remove it first, "
        "with Open3D's segment_plane or read_cloud(..., where='z > ...')"
    )
    return Reason("sheet", text, numbers=dict(share=share)) if share > CURVE.majority else None


def _by_component(curve: Curve) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The component of every point of the cloud, the points of each, (c, 1), and where they are, from one vertex."""
    component = curve.component_of_vertex[curve.cloud.vertex]
    size = np.bincount(component, minlength=curve.n_components)[:, None]
    return component, size, curve.cloud.points - curve.vertices[0]


def _is_tree(curve: Curve) -> np.ndarray:
    """Which components have no loop to go round, (c,) bool array."""
    n = curve.n_components
    edges = np.bincount(curve.component_of_vertex[curve.edges[:, 0]], minlength=n)
    return edges < np.bincount(curve.component_of_vertex, minlength=n)


def _ball(curve: Curve) -> Reason | None:
    """The normal lines of components with most of the points meet in one point, and they have no loop."""
    cloud, n = curve.cloud, curve.n_components
    component, size, points = _by_component(curve)
    along = np.einsum("ni,nj->nij", cloud.normals, cloud.normals)
    # of every normal line I - n n^T, which takes away what is along it
    regular = WARN.regular * np.maximum(size, 1)
    weight = (size + regular)[:, :, None] * np.eye(3) - group_sum(along, component, n)
    height = dot(cloud.normals, points)[:, None]
    meet = np.linalg.solve(weight, group_sum(points - height * cloud.normals, component, n)[:, :, None])[:, :, 0]
    offset = points - meet[component]
    distance = dot(offset, offset)
    miss = distance - dot(cloud.normals, offset) ** 2
    spread = group_sum(np.column_stack([miss, distance]), component, n)
    ball = _is_tree(curve) & (spread[:, 0] < WARN.ball_spread**2 * spread[:, 1])
    share = float(size[ball].sum() / len(cloud.vertex))
    text = (
        f"sphere-like: the normals of parts with {share:.0%} of the points meet in one point, "
        "so no curve skeleton is meaningful there"
    )
    return Reason("sphere", text, numbers=dict(share=share)) if share > CURVE.majority else None


def _stubs(curve: Curve) -> Reason | None:
    """Components with most of the points are hardly longer than thick, and have no loop to go round."""
    cloud, n = curve.cloud, curve.n_components
    component, size, points = _by_component(curve)
    mean = group_sum(points, component, n) / np.maximum(size, 1)
    products = np.einsum("ni,nj->nij", points, points)
    spread = group_sum(products, component, n) / np.maximum(size, 1)[:, :, None] - mean[:, :, None] * mean[:, None]
    length = np.sqrt(12 * np.maximum(np.linalg.eigvalsh(spread)[:, 2], 0))
    reach = group_median(norm(cloud.offset), component, n)
    share = float(size[_is_tree(curve) & (length < CURVE.stub * reach)].sum() / len(cloud.vertex))
    text = (
        f"sphere-like: parts with {share:.0%} of the points are hardly longer than thick, as balls, bowls and boxes "
        "are, so no curve skeleton is meaningful there; only limbs and handles on them may be right"
    )
    return Reason("sphere", text, numbers=dict(share=share)) if share > CURVE.majority else None


def _close_calls(curve: Curve) -> list[Reason]:
    close = [decision for decision in curve.report.uncertain if decision.about != "limb"]
    if not close:
        return []
    asked = sum(decision.about != "limb" for decision in curve.report.decisions)
    text = (
        f"uncertain topology: {len(close)} of {asked} questions about loops, air and gaps were close calls, above all "
        f"whether {close[0].question} (probability {close[0].probability:.2f}): look there; "
        f"if '{close[0].outcome}' is wrong, set {close[0].otherwise}"
    )
    numbers = dict(close=len(close), asked=asked, probability=close[0].probability)
    return [Reason("close call", text, close[0].place, numbers)]


def _opened_loops(curve: Curve) -> list[Reason]:
    """A graph without loops, made by request of an object that probably has some, for the number of its ends."""
    rooted = bool(curve.report.root)  # a Tracer has opened them
    closed = [call for call in curve.report.decisions if call.about == "loop" and (call.changed or rooted)]
    handles = [call for call in closed if call.probability > 0.5 and not call.is_uncertain]
    if curve.n_loops or len(handles) <= WARN.opened * len(curve.leaves):
        return []
    surest = max(handles, key=lambda call: call.probability)
    text = (
        f"opened loops: the graph has none, but {surest.question} with a probability of {surest.probability:.2f}: "
        "is the object a tree? The pipeline 'default' without a root keeps loops"
    )
    return [Reason("opened loops", text, surest.place, dict(probability=surest.probability))]


def _weak_region(curve: Curve) -> list[Reason]:
    count = curve.cloud.count
    weak = curve.confidence < WARN.low_confidence
    share = count[weak].sum() / count.sum()
    if share <= WARN.low_share:
        return []
    inner = curve.edges[weak[curve.edges].all(axis=1)]
    label = component_labels(len(weak), inner)
    most = np.argmax(np.bincount(label[weak], count[weak], minlength=len(weak)))
    region = curve.vertices[weak & (label == most)]
    middle = region.mean(axis=0)
    x, y, z = middle.tolist()
    reach, place = float(norm(region - middle).max()), coordinates(middle)
    text = (
        f"weakly supported: around {share:.0%} of the points, above all within {reach:.3g} of ({place}), the points do "
        "not agree on an axis: they are too sparse or noisy, or their parts are no tubes, such as a table under it"
    )
    return [Reason("weak region", text, (x, y, z), dict(share=float(share), reach=reach))]
