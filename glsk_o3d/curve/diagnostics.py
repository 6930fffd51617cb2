"""Warnings about places without a meaningful curve skeleton: sheets, balls, and points that do not determine it."""

from dataclasses import dataclass

import numpy as np

from ..data.decisions import coordinates
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


WARN = WarningNumbers()


REASONS = ("sheet-like", "sphere-like", "no edges", "uncertain topology", "weakly supported")
"""What the messages of `diagnose` begin with."""


def measured(curve: Curve) -> Curve:
    """A finished curve with its sections, and with the reasons not to trust it among the warnings of its report.

    They take the place of those of before, and follow what other filters warned of.
    """
    sections = curve.sections
    curve = curve.changed(half_width=sections.half_width, half_thickness=sections.half_thickness)
    others = [message for message in curve.report.warnings if message.partition(":")[0] not in REASONS]
    return curve.with_facts(warnings=(*others, *diagnose(curve)))


def diagnose(curve: Curve) -> list[str]:
    """Reasons not to trust a curve: the cloud is sheet-like, sphere-like, or does not say where much of the axis is.

    Sheet-like: the normals around a vertex have one direction, and it has little confidence, unlike a blade, which has
    two sides; or it is of a component whose curve is hardly longer than the part is wide: a coin, a plate. Sphere-like:
    the normal lines of a whole component meet in one point, or it is hardly longer than thick. All are scale-free. Of a
    cloud that is neither, the parts with little confidence are named, and the least certain question about loops, air
    and gaps. No edges at all are a reason, too.
    """
    cloud = curve.cloud
    if len(cloud.rows) == 0:
        return []
    vertex, normals, count = cloud.vertex, cloud.normals, cloud.count
    along = np.einsum("ni,nj->nij", normals, normals)

    part, n = curve.component_of_vertex, curve.n_components
    component = part[vertex]
    size = np.bincount(component, minlength=n)[:, None]
    one_way = np.linalg.eigvalsh(group_sum(along, vertex, len(count)))[:, 2] > CURVE.sheet * np.maximum(count, 1)
    length = np.bincount(part[curve.edges[:, 0]], curve.edge_lengths, n)
    stub = length < CURVE.stub * group_median(curve.half_width[vertex], component, n)
    sheet = count[one_way & (~(curve.confidence >= WARN.low_confidence) | stub[part])].sum() / len(vertex)
    if sheet > CURVE.majority:
        return [
            f"sheet-like: around {sheet:.0%} of the points the surface faces one direction only, "
            "so a curve skeleton has little meaning; if that is a table or a floor under an object, remove it first, "
            "with Open3D's segment_plane or read_cloud(..., where='z > ...')"
        ]

    points = cloud.points - curve.vertices[0]
    # of every normal line I - n n^T, which takes away what is along it
    weight = (size[:, :, None] + WARN.regular * np.maximum(size, 1)[:, :, None]) * np.eye(3) - group_sum(
        along, component, n
    )
    height = dot(normals, points)[:, None]
    meet = np.linalg.solve(weight, group_sum(points - height * normals, component, n)[:, :, None])[:, :, 0]
    offset = points - meet[component]
    distance = dot(offset, offset)
    miss = distance - dot(normals, offset) ** 2
    spread = group_sum(np.column_stack([miss, distance]), component, n)
    ball = spread[:, 0] < WARN.ball_spread**2 * spread[:, 1]
    share = size[ball].sum() / len(vertex)
    if share > CURVE.majority:
        return [
            f"sphere-like: the normals of parts with {share:.0%} of the points meet in one point, "
            "so no curve skeleton is meaningful there"
        ]
    spread = group_sum(np.einsum("ni,nj->nij", points, points), component, n) / np.maximum(size, 1)[:, :, None]
    mean = group_sum(points, component, n) / np.maximum(size, 1)
    length = np.sqrt(12 * np.maximum(np.linalg.eigvalsh(spread - mean[:, :, None] * mean[:, None])[:, 2], 0))
    reach = group_median(norm(cloud.offset), component, n)
    share = size[length < CURVE.stub * reach].sum() / len(vertex)
    if share > CURVE.majority:
        return [
            f"sphere-like: parts with {share:.0%} of the points are hardly longer than thick, "
            "so no curve skeleton is meaningful there"
        ]
    if len(curve.edges) == 0:
        return ["no edges: every part became one vertex; is Connector.radius larger than the parts are long?"]
    return _weak_region(curve, count) + _close_calls(curve)


def _close_calls(curve: Curve) -> list[str]:
    close = [decision for decision in curve.report.uncertain if decision.about != "limb"]
    if not close:
        return []
    asked = sum(decision.about != "limb" for decision in curve.report.decisions)
    return [
        f"uncertain topology: {len(close)} of {asked} questions about loops, air and gaps were close calls, above all "
        f"whether {close[0].question} (probability {close[0].probability:.2f}): look there; "
        f"if '{close[0].outcome}' is wrong, set {close[0].otherwise}"
    ]


def _weak_region(curve: Curve, count: np.ndarray) -> list[str]:
    weak = curve.confidence < WARN.low_confidence
    share = count[weak].sum() / count.sum()
    if share <= WARN.low_share:
        return []
    inner = curve.edges[weak[curve.edges].all(axis=1)]
    label = component_labels(len(weak), inner)
    most = np.argmax(np.bincount(label[weak], count[weak], minlength=len(weak)))
    region = curve.vertices[weak & (label == most)]
    middle = region.mean(axis=0)
    reach, place = norm(region - middle).max(), coordinates(middle)
    return [
        f"weakly supported: around {share:.0%} of the points, above all within {reach:.3g} of ({place}), the points do "
        "not agree on an axis: they are too sparse or noisy, or their parts are no tubes, such as a table under it"
    ]
