"""What no point supports is in the report, and what few points support alone is no part."""

import numpy as np
import pytest

from glsk_o3d import Skeleton, Tracer, pipelines, samples
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.thin.detect import without_detached_clumps

pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")


def gap_of(skeleton):
    (gap,) = skeleton.report.joined
    return np.array(sorted(gap))


@pytest.mark.parametrize(("at", "scale"), [(0.3, 1.0), (0.6, 1000.0)])
def test_the_report_has_the_ends_of_a_bridge(at, scale):
    """A part of a tube was not scanned: the report has the ends of what leads across, in the cloud's units."""
    points = scale * samples.tube(4000, length=2, radius=0.1).points
    middle = scale * (2 * at - np.mean([0, 2])) + points[:, 0].mean()
    cut = points[np.abs(points[:, 0] - middle) > 0.12 * scale]
    skeleton = pipelines.default()(cut)
    assert (skeleton.n_components, skeleton.report.n_bridges) == (1, 1)
    gap = gap_of(skeleton)
    assert gap[0, 0] < middle < gap[1, 0]
    assert 0.1 < (gap[1, 0] - gap[0, 0]) / scale < 0.6
    rooted = Tracer(root="x")(skeleton)
    np.testing.assert_array_equal(gap_of(rooted), gap)  # a tree has it, too


@pytest.mark.parametrize("size", [0.003, 0.03])
@pytest.mark.parametrize("n", [40, 60])
def test_a_few_flying_points_are_no_part(n, size):
    """They are outliers; without cuts in empty space they stay."""
    tube, rng = samples.tube(3000, length=2, radius=0.1).points, np.random.default_rng(n)
    cloud = np.concatenate([tube, tube.mean(axis=0) + [0, 1, 0] + size * rng.normal(size=(n, 3))])
    assert pipelines.default().with_options(air=0)(cloud).n_components == 2
    skeleton = pipelines.default()(cloud)
    assert (skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)) == (1, 0, 2)
    assert skeleton.report.n_outliers >= n
    assert np.isnan(skeleton.normals[-n:]).all()
    assert (skeleton.vertex_of_point >= 0).all()


def clumps(*counts, edges=()):
    """A vertex with so many points each, and edges between some."""
    rng, m = np.random.default_rng(0), len(counts)
    vertex = np.repeat(np.arange(m), counts)
    points, normals = rng.normal(size=(2, len(vertex), 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Curve.of(Skeleton(10 * rng.normal(size=(m, 3)), edges, np.ones(m), vertex, points, normals))


@pytest.mark.parametrize(
    ("counts", "edges", "remaining"),
    [
        ((500, 500, 63), [(0, 1)], 2),  # so few say nothing
        ((500, 500, 64), [(0, 1)], 3),  # a ball
        ((10, 10, 11), [(0, 1)], 3),  # of few points in all, most
        ((10, 10, 9), [(0, 1)], 2),
        ((500, 500, 3, 700, 0), [(0, 1)], 3),
        ((5, 50, 500), [], 3),  # there is no other part
        ((5, 50, 500), [(0, 1), (1, 2)], 3),
    ],
)
def test_a_detached_clump_of_few_points_is_no_part(counts, edges, remaining):
    skeleton = clumps(*counts, edges=edges)
    cleaned = without_detached_clumps(skeleton)
    assert len(cleaned.vertices) == remaining
    n_outliers = cleaned.report.n_outliers
    assert n_outliers == sum(counts) - len(cleaned.supporting_points) == np.isnan(cleaned.normals[:, 0]).sum()
