"""Points found and true points, matched one to one."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from ..numerics.groups import component_labels

# derived: one radius from where the axis ends, in the middle of the round end, to the tip, and 1.5 along the axis
TIP_REACH = 2.5
# derived: where limbs meet is known to a local radius, that of the junction found and that of the true one
JUNCTION_REACH = 2.0


def matching_f1(found, true, reach):
    """F1 of found points as a guess at the true ones, (n, 3) and (m, 3); 1 if there are neither.

    A pair is no further apart than the `reach`, (m,), of its true point. The nearest pairs come first, each point once.
    """
    if len(found) == 0 or len(true) == 0:
        return float(len(found) == len(true))
    return 2 * len(matched(found, true, reach)) / (len(found) + len(true))


def matched(found, true, reach):
    """The pairs of `matching_f1`: a list of (row of `found`, row of `true`)."""
    apart = cdist(found, true)
    apart[apart > reach] = np.inf
    pairs = []
    while np.isfinite(apart.min(initial=np.inf)):
        row, column = np.unravel_index(apart.argmin(), apart.shape)
        apart[row], apart[:, column] = np.inf, np.inf
        pairs.append((int(row), int(column)))
    return pairs


def merged_junctions(points, axis, axis_radius):
    """Clusters of junctions, (n, 3), that are within a local radius of the next one: their means and local radii.

    The local radius of a junction is that of the thickest part whose ball around a place of the axis holds it, else
    that of the nearest place; of a cluster it is the largest. `axis` (k, 3) and `axis_radius` (k,) are places along the
    true axis.
    """
    away = cdist(points, axis)
    local = np.where(away < axis_radius, axis_radius, 0.0).max(axis=1)
    local = np.where(local > 0, local, axis_radius[away.argmin(axis=1)])
    near = cdist(points, points) <= np.maximum(local[:, None], local)
    group = component_labels(len(points), np.argwhere(near))
    size = np.bincount(group)
    means = np.column_stack([np.bincount(group, values) for values in points.T]) / size[:, None]
    largest = np.zeros(len(size))
    np.maximum.at(largest, group, local)
    return means, largest
