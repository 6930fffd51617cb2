"""What makes a draw fair: its axis is no matter of taste, and a cloud of 4096 points can show it."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from glsk_o3d.numerics.groups import component_labels

from .paths import FINE_STEP, chains, shortest_loop, subdivided
from .solid import topology

# Fitted, as all of this page: on draws that people would not agree about.
GAP = 0.5  # between parts that are not joined nearby, at least, in the smaller radius
NEARBY = 2  # what is joined nearby is so within so many times the sum of both radii
STUB = 0.75  # how far the middle of a tip stands out of all else, at least, in its radius
THINNEST_SPACINGS = 1.2  # least radius, in the mean distance of 4096 points
MOST_PLACES = 3000  # along an axis: all pairs are looked at
LOOP_SAMPLES = 30  # places on a loop, between each two of which a ball is tried


def fault(nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray, spacing: float) -> str | None:
    """Why a shape cannot be kept.

    Parameters
    ----------
    nodes : (M, 3) float array
    edges : (E, 2) int array
    radii : (M,) float array
    spacing : float
        Mean distance of 4096 points on its surface.

    Returns
    -------
    str or None
        The first that is wrong:

        - ``thin``: a part is thinner than `THINNEST_SPACINGS` times the spacing,
        - ``large``: there are too many pieces to look at,
        - ``gap``: parts come near each other that are not joined nearby,
        - ``opening``: a loop has no room for a ball as thick as its thinnest part,
        - ``stub``: a tip hardly stands out of the rest,
        - ``holes``: the solid has other loops or components than the axis, or cavities.
    """
    if radii.min() < THINNEST_SPACINGS * spacing:
        return "thin"
    places, links, thick = subdivided(nodes, edges, radii, FINE_STEP)
    if len(places) > MOST_PLACES:
        return "large"
    apart = cdist(places, places)
    if _gap(apart, links, thick, spacing):
        return "gap"
    found = _unclear(places, links, thick, apart)
    if found:
        return found
    components = int(component_labels(len(places), links).max()) + 1
    expected = (components, len(links) - len(places) + components, 0)
    return None if topology(places, thick) == expected else "holes"


def _gap(apart, links, radii, spacing):
    """Whether two places are near that cannot be reached from each other along the axis without going far.

    Far from a place is what is more than `NEARBY` times two radii off: its own, and that of the thickest part that the
    other one is inside of. What can be reached from which place are the components of a graph of pairs: (i, j) and
    (i, k) are joined if a link joins j and k and both are near i.
    """
    holder = np.where(apart < radii, radii, 0).max(axis=1)
    smaller = np.minimum(radii[:, None], radii)
    close = apart < radii[:, None] + radii + np.maximum(GAP * smaller, spacing)
    near = apart < NEARBY * (radii[:, None] + holder)
    number = np.cumsum(near).reshape(near.shape) - 1
    a, b = links.T
    place, link = np.nonzero(near[:, a] & near[:, b])
    pairs = np.column_stack([number[place, a[link]], number[place, b[link]]])
    label = component_labels(int(near.sum()), pairs)[number]
    return bool((close & ~(near & (label == np.diag(label)[:, None]))).any())


def _unclear(places, links, radii, apart):
    """The first path whose loop is closed up or whose tip is hidden: ``opening`` or ``stub``; else None."""
    n = len(places)
    degree, lengths = np.bincount(links.ravel(), minlength=n), apart[tuple(links.T)]
    paths = chains(n, links)
    for path in paths:
        loop = shortest_loop(n, links, lengths, path)
        if loop and not _opens(places[loop], radii[loop].min(), places, radii):
            return "opening"
        if len(paths) > 1:
            others = np.setdiff1d(np.arange(n), path)
            for tip in {path[0], path[-1]}:
                if degree[tip] == 1 and len(others) and (apart[tip] - radii)[others].min() < STUB * radii[tip]:
                    return "stub"
    return None


def _opens(loop, radius, places, radii):
    """Whether a ball of this radius has room somewhere between two places of a loop."""
    some = loop[np.linspace(0, len(loop) - 1, LOOP_SAMPLES).astype(int)]
    middles = (some[:, None] + some)[np.triu_indices(LOOP_SAMPLES, 1)] / 2
    return (cdist(middles, places) - radii).min(axis=1).max() >= radius
