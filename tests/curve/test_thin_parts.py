"""Parts that are thin against the spacing of the points: wires, twigs of dense clouds, and what only looks so."""

import numpy as np
import pytest

from glsk_o3d import skeletonize
from glsk_o3d.geometry.polylines import places_on_edges

pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")


def tubes(nodes, edges, radius, n, seed=0):
    """Random points on open tubes around straight edges."""
    rng, nodes, edges = np.random.default_rng(seed), np.asarray(nodes, float), np.asarray(edges)
    along = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    area = np.linalg.norm(along, axis=1) * radius
    edge, t, turn = rng.choice(len(edges), n, p=area / area.sum()), rng.random(n), 2 * np.pi * rng.random(n)
    across = np.cross(along[edge], [0.3, 0.5, 0.8])
    across /= np.linalg.norm(across, axis=1)[:, None]
    other = np.cross(along[edge], across)
    other /= np.linalg.norm(other, axis=1)[:, None]
    around = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * other
    return places_on_edges(nodes, edges, edge, t) + np.broadcast_to(radius, len(edges))[edge, None] * around


def net(n):
    """A square net of n x n knots."""
    knots = np.array(list(np.ndindex(n, n, 1)), float)
    return knots, np.array([(i, j) for i in range(n * n) for j in range(i) if np.abs(knots[i] - knots[j]).sum() == 1])


@pytest.mark.parametrize("around", [4, 4.5])
def test_a_net_of_wires_keeps_its_loops(around):
    """Whose wires have too few points around them for a surface."""
    (nodes, edges), radius = net(5), 0.02
    length = np.linalg.norm(nodes[edges[:, 0]] - nodes[edges[:, 1]], axis=1).sum()
    n = round(length * around**2 / (2 * np.pi * radius))
    skeleton = skeletonize(tubes(nodes, edges, radius, n))
    assert (skeleton.n_components, skeleton.n_loops) == (1, len(edges) - len(nodes) + 1)
    assert len(skeleton.leaves) <= 1
    assert skeleton.length == pytest.approx(length, rel=0.05)
    assert skeleton.report.n_traced == 0


def clumps(n, several, seed=0):
    """A rod of points in clumps, as of multi-view stereo: as thick as it is wide, and 8 radii long."""
    rng = np.random.default_rng(seed)
    m = n // several
    turn, out = 2 * np.pi * rng.random(m), np.sqrt(rng.random(m))
    rod = np.column_stack([8 * rng.random(m), out * np.cos(turn), out * np.sin(turn)])
    return rod[rng.integers(m, size=n)] + 0.3 * rng.gamma(1, size=(n, 1)) * rng.normal(size=(n, 3))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("n", "several"), [(300, 3), (300, 4), (1000, 5)])
def test_a_part_scattered_as_thick_as_it_is_wide_is_no_bundle_of_twigs(n, several, seed):
    skeleton = skeletonize(clumps(n, several, seed))
    assert skeleton.report.n_traced == 0
    assert len(skeleton.leaves) < 10
