"""Points in rows: scan lines, lidar rings and slices, much nearer along a row than from one row to the next."""

import numpy as np

from .neighbourhoods import nearest_neighbours, principal
from .vectors import TINY, norm

ROW_PLACES = 500  # speed: places at which rows are looked for
ROW_DIMENSION = 1.5  # derived: halfway between a curve and a surface
DOUBLINGS = 3  # speed: of the usual number of neighbours, at most
NEXT_ROWS = 2.0  # derived: times as many neighbours as a row alone has: 1.15 times as far as the next row, both see it


def reach_next_rows(points: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """The neighbours (n, k) of points, or more of them, (n, K), where rows would hide the surface.

    Within a distance r a row has in the order of r points, a surface r^2. Where k neighbours grow as along a curve,
    more are looked at: if most of their neighbourhoods are planar (Demantke et al. 2011, "Dimensionality based scale
    selection in 3D lidar point clouds"), the points lie in rows on a surface; those of twigs are not. K is the number
    at which there are twice as many neighbours as on the row alone.
    """
    n, k = neighbours.shape
    places, few = np.arange(0, n, max(n // ROW_PLACES, 1)), max(k // 4, 2)
    near, far = (norm(points[neighbours[places, each]] - points[places]) for each in (few, k - 1))
    if np.median(near * ((k - 1) / few) ** (1 / ROW_DIMENSION) - far) > 0:
        return neighbours
    distance, around = nearest_neighbours(points, max(min(k << DOUBLINGS, n // 4), k), of=points[places])
    sizes = k << np.arange(DOUBLINGS + 1)  # more than a quarter of a cloud is no neighbourhood
    for size in sizes[sizes <= around.shape[1]]:
        third, second, first = np.sqrt(principal(points, around[:, :size])[0].T)
        if 2 * np.count_nonzero(second - third > np.maximum(first - second, third)) > len(places):
            break  # most are rather planar than linear or scattered
    else:
        return neighbours
    on_row = few * distance / np.maximum(near, TINY)[:, None]
    reached = np.arange(distance.shape[1]) >= NEXT_ROWS * on_row
    reached[:, :k], reached[:, -1] = False, True
    return nearest_neighbours(points, int(np.median(reached.argmax(axis=1))) + 1)[1]
