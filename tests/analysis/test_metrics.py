"""The measures, on closed forms; against the yardstick that is not in the repository, where it is there."""

import importlib.util
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from glsk_o3d import read_truth
from glsk_o3d.analysis import Truth, assess, compare
from glsk_o3d.analysis.cross_sections import cross_sections
from glsk_o3d.errors import FileFormatError, InvalidCloudError, InvalidParameterError
from glsk_o3d.samples import helix, sample_object, sphere, torus, tube, two_rings, y_junction
from glsk_o3d.skeleton import Skeleton


def curve(vertices, edges=None, radii=np.nan):
    """A skeleton without a cloud; a path through the vertices if no edges are given."""
    vertices = np.asarray(vertices, float)
    n = len(vertices)
    if edges is None:
        edges = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    return Skeleton(vertices, edges, np.broadcast_to(radii, n), (), (), ())


def axis_of(sample, scale=1.0, shift=0.0):
    return curve(sample.nodes * scale + np.asarray(shift), sample.edges, sample.radii)


@pytest.fixture(scope="module")
def pipe():
    """An open tube along x, radius 0.1, length 1: 100 rings of 40 points, each turned against the one before."""
    ring, place = np.divmod(np.arange(4000), 40)
    angle = 2 * np.pi * (place / 40 + 0.618034 * ring)
    points = np.column_stack([(ring + 0.5) / 100 - 0.5, 0.1 * np.cos(angle), 0.1 * np.sin(angle)])
    return replace(tube(8, capped=False), points=points)


@pytest.fixture(scope="module")
def ring():
    """A torus around z: radii 0.4 and 0.1."""
    return torus(16000)


SAMPLES = [tube, torus, helix, y_junction, two_rings, sample_object]

# ------------------------------------------------------------------------------------------------------ with a truth


@pytest.mark.parametrize("make", SAMPLES)
def test_the_axis_itself(make):
    sample = make(100)
    same = compare(axis_of(sample), sample)
    assert same.error < 1e-12
    assert (same.inside, same.completeness) == (1, 1)
    assert same.ends == (None if make in (torus, two_rings) else 0)
    assert same.radius_error < 1e-12
    assert (same.components, same.loops, same.leaves, same.junctions) == (0, 0, 0, 0)
    assert same.topology is True
    assert same.edge_error.shape == (len(sample.edges),)


@pytest.mark.parametrize("d", [0.03, 0.099, 0.101, 0.25])
def test_a_shift_is_an_error_of_as_many_radii(d):
    sample = tube(100, radius=0.1)
    found = compare(axis_of(sample, shift=[0, d, 0]), sample)
    assert found.error == pytest.approx(d / 0.1, rel=1e-12)
    assert found.ends == pytest.approx(d / 0.1, rel=1e-12)
    assert found.inside == found.completeness == (d < 0.1)
    np.testing.assert_allclose(found.edge_error, d / 0.1)


def test_half_of_the_axis():
    sample = tube(100, length=4, radius=0.01)
    found = compare(curve([[-2, 0, 0], [0, 0, 0]]), sample)
    assert found.completeness == pytest.approx(0.5 + 0.01 / 4, abs=0.001 / 4)  # and one radius more
    assert (found.error, found.inside) == (pytest.approx(0, abs=1e-12), 1)
    assert found.ends == pytest.approx((0 + 2 / 0.01) / 2)


def test_errors_are_in_the_radius_nearby():
    cone = Truth([[0, 0, 0], [1, 0, 0]], [[0, 1]], [0.1, 0.3])
    found = compare(curve([[0, 0.1, 0], [1, 0.1, 0]]), cone)
    assert found.error == pytest.approx(0.1 / 0.2 * np.log(3), rel=1e-3)  # the mean of 0.1 / (0.1 + 0.2 x)


def test_radii_are_interpolated(pipe):
    vertices = [[-0.5, 0, 0], [0.5, 0, 0]]
    assert compare(curve(vertices, radii=[0.1, 0.3]), pipe).radius_error == pytest.approx(1, rel=1e-12)
    assert compare(curve(vertices, radii=[0.05, 0.05]), pipe).radius_error == pytest.approx(0.5)
    assert compare(curve(vertices), pipe).radius_error is None
    known = curve([*vertices, [0.5, 0, 0.1]], radii=[0.2, 0.2, np.nan])
    assert compare(known, pipe).radius_error == pytest.approx(1)


def test_structure_is_counted(ring):
    open_ring = compare(curve(ring.nodes), ring)
    assert (open_ring.components, open_ring.loops, open_ring.leaves, open_ring.junctions) == (0, -1, 2, 0)
    assert not open_ring.topology
    twice = compare(curve([*ring.nodes, [0, 0, 0]], np.concatenate([ring.edges, ring.edges[:, ::-1]])), ring)
    assert (twice.components, twice.loops, twice.leaves) == (1, 0, 0)  # repeated edges are none; one vertex is alone
    assert not twice.topology
    hair = compare(curve([*ring.nodes, [0.5, 0, 0]], [*ring.edges.tolist(), [0, len(ring.nodes)]]), ring)
    assert (hair.leaves, hair.junctions, hair.topology) == (1, 1, True)


def test_a_ball_has_one_node():
    ball = sphere(100, radius=0.5)
    found = compare(curve([[0.1, 0, 0]], np.empty((0, 2), int)), ball)
    assert (found.error, found.inside, found.completeness) == (pytest.approx(0.2), 1, 1)
    assert (found.ends, found.topology, found.edge_error.shape) == (None, True, (0,))


def test_a_skeleton_without_leaves_ends_at_its_nearest_vertex(ring):
    straight = Truth([[0.9, 0, 0], [2, 0, 0]], [[0, 1]], [0.1, 0.2])
    assert compare(axis_of(ring), straight).ends == pytest.approx((5 + 8) / 2)


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_units_and_places_do_not_matter(scale):
    sample = sample_object(100)
    bent = curve(sample.nodes + 0.02 * np.sin(40 * sample.nodes[:, ::-1]), sample.edges, 0.9 * sample.radii)
    there = Truth(sample.nodes * scale + scale, sample.edges, sample.radii * scale)
    moved = curve(bent.vertices * scale + scale, bent.edges, bent.radii * scale)
    expected, found = compare(bent, sample).as_dict(), compare(moved, there).as_dict()
    assert found == pytest.approx(expected, rel=1e-6)
    assert expected["error"] > 0.05


@pytest.mark.parametrize("name", ["bent_tube", "double_torus", "ladder", "quadruped", "sphere", "tree2", "two"])
def test_agrees_with_the_yardstick(shared_dir, name):
    spec = importlib.util.spec_from_file_location("yardstick", shared_dir / "score.py")
    spec.loader.exec_module(yardstick := importlib.util.module_from_spec(spec))
    if name == "two":
        sample = two_rings(100)
        truth = {key: getattr(sample, key) for key in ("nodes", "edges", "radii")}
    else:
        with np.load(shared_dir / "truth" / f"{name}.npz") as file:
            truth = {key: file[key] for key in ("nodes", "edges", "radii")}
    rng = np.random.default_rng(0)
    for noise in (0, 0.3, 2):
        vertices = truth["nodes"] + noise * truth["radii"][:, None] * rng.normal(size=truth["nodes"].shape)
        edges = truth["edges"][rng.random(len(truth["edges"])) < 0.95]
        expected = yardstick.score(truth, vertices, edges)
        found = compare(curve(vertices, edges), SimpleNamespace(**truth)).as_dict()
        assert found.pop("radius_error") is None
        assert found.keys() - expected.keys() == ({"ends"} if found["ends"] is None else set())
        found = {key: found[key] for key in expected}
        assert found == pytest.approx(expected, abs=1e-12, rel=1e-12)


# --------------------------------------------------------------------------------------------------- without a truth


@pytest.mark.parametrize(
    ("d", "centredness", "boundedness"),
    [(0, 1, 1), (0.02, 0.8, 1), (0.05, 0.5, 1), (0.09, 0.1, 1), (0.1, 0, 1), (0.14, 0, 0), (0.3, 0, 0)],
)
def test_a_tube_and_a_line_beside_its_axis(pipe, d, centredness, boundedness):
    """Every point of an open tube lies on the circle that is fitted: exact however few points there are."""
    found = assess(axis_of(pipe, shift=[0, d, 0]), pipe.points)
    assert found.centredness == pytest.approx(centredness, abs=1e-12)
    assert found.boundedness == boundedness
    assert found.smoothness == found.topology == 1
    np.testing.assert_allclose(found.edge_centredness, [centredness], atol=1e-12)


def test_what_is_seen_of_a_tube_from_outside(pipe):
    """arcsin(r / x) / pi of all directions."""
    for x in (0.11, 0.2, 0.4):
        sections = cross_sections(pipe.nodes + [0, 0, x], [np.array([0, 1])], pipe.points, shortest=0.1)
        seen = 1 - np.average(sections.open_angles, weights=sections.counts) / (2 * np.pi)
        assert seen == pytest.approx(np.arcsin(0.1 / x) / np.pi, rel=0.01)
        np.testing.assert_allclose(sections.radii, 0.1, rtol=1e-9)
        np.testing.assert_allclose(sections.offsets, x, rtol=1e-9)


def test_between_two_tubes_is_outside(pipe):
    """Two tubes whose axes are 2 x apart show 2 arcsin(r / x) / pi: a third from their middle at x = 2 r."""
    for x, bounded in ((0.19, 1), (0.21, 0)):
        both = np.concatenate([pipe.points + [0, x, 0], pipe.points - [0, x, 0]])
        assert assess(axis_of(pipe), both).boundedness == bounded


@pytest.mark.parametrize(("ring_radius", "centredness"), [(0.4, 1), (0.35, 0.5), (0.45, 0.5), (0.5, 0), (0.3, 0)])
def test_a_torus_and_circles_beside_its_axis(ring, ring_radius, centredness):
    found = assess(axis_of(ring, scale=ring_radius / 0.4), ring.points)
    assert found.centredness == pytest.approx(centredness, abs=2e-3)  # a section is a little longer than thin
    assert found.smoothness == pytest.approx(1 - 0.1 / (np.pi * ring_radius), abs=1e-3)
    (loop,) = found.loops
    assert (loop.opening, loop.thickness) == (pytest.approx(ring_radius, rel=0.01), pytest.approx(0.1, rel=0.01))
    assert (loop.wider, found.topology) == (True, 1)


def test_a_circle_in_the_hole_of_a_torus_is_outside(ring):
    found = assess(axis_of(ring, scale=0.5), ring.points)
    assert (found.centredness, found.boundedness) == (0, 0)


@pytest.mark.parametrize("make", SAMPLES)
@pytest.mark.parametrize("n", [1000, 4096])
def test_the_axis_of_every_sample_is_good(make, n):
    sample = make(n)
    found = assess(axis_of(sample), sample.points)
    assert found.centredness > (0.85 if make is sample_object else 0.97)  # two cameras did not see all of it
    assert found.boundedness > 0.94
    assert found.smoothness > 0.9
    assert found.topology == 1
    assert found.components == found.clusters == (2 if make is two_rings else 1)
    assert len(found.loops) == found.wide_loops == {torus: 1, two_rings: 2, sample_object: 1}.get(make, 0)


def test_half_a_tube_has_the_axis_of_the_whole(pipe):
    seen = pipe.points[pipe.points[:, 2] > 0]
    found = assess(axis_of(pipe), seen)
    assert found.centredness == pytest.approx(1, abs=1e-12)
    assert found.boundedness == 1


def test_a_bridge_through_the_air_is_outside(pipe):
    """Two tubes end to end, one tube's length apart."""
    both = np.concatenate([pipe.points - [1, 0, 0], pipe.points + [1, 0, 0]])
    found = assess(curve([[-1.5, 0, 0], [1.5, 0, 0]]), both)
    assert found.boundedness == pytest.approx(2 / 3, abs=0.02)
    assert found.centredness == pytest.approx(1, abs=0.02)
    assert (found.components, found.clusters, found.topology) == (1, 2, 0.5)


def test_smoothness_of_a_zigzag(pipe):
    """Turning by 90 degrees every 0.02 in a tube of radius 0.1."""
    x = np.arange(-20, 21) * 0.02 / np.sqrt(2)
    zigzag = curve(np.column_stack([x, 0.02 / np.sqrt(2) * (np.arange(41) % 2), 0 * x]))
    assert assess(zigzag, pipe.points).smoothness == 0
    coarse = curve([[-0.5, 0, 0], [0, 0, 0], [0, 0.05, 0], [0.5, 0.05, 0]])
    expected = 1 - 2 * (np.pi / 2) * 0.1 / (np.pi * coarse.length)
    assert assess(coarse, pipe.points).smoothness == pytest.approx(expected, rel=0.02)


def test_repeated_points_do_not_turn(pipe):
    path = np.linspace([-0.5, 0, 0], [0.5, 0, 0], 9)
    assert assess(curve(np.repeat(path, 2, axis=0)), pipe.points).smoothness == 1


def test_false_loops_open_less_than_their_tube(pipe):
    square = curve(
        [[-0.5, 0, 0], [0, -0.03, 0], [0, 0.03, 0], [0.06, 0.03, 0], [0.06, -0.03, 0], [0.5, 0, 0]],
        [[0, 1], [1, 2], [2, 3], [3, 4], [1, 4], [4, 5]],
    )
    found = assess(square, pipe.points)
    (loop,) = found.loops
    assert loop.opening == pytest.approx(0.03, rel=0.02)
    assert (loop.wider, found.wide_loops, found.topology) == (False, 0, 0)
    assert np.isnan(found.edge_centredness).any()  # at its junctions


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_assessments_have_no_unit(scale):
    sample = sample_object(2000)
    axis = axis_of(sample)
    expected = assess(axis, sample.points)
    found = assess(replace(axis, vertices=axis.vertices * scale + scale), sample.points * scale + scale)
    assert found.clusters == expected.clusters == 1
    for name in ("centredness", "boundedness", "smoothness", "topology"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=1e-6)


def test_outliers_and_points_that_are_not_finite(pipe):
    found = assess(axis_of(pipe), np.concatenate([pipe.points, [[0, 3, 0], [np.nan, 0, 0], [0, 0, -np.inf]]]))
    assert found.centredness == pytest.approx(1, abs=1e-12)
    assert found.boundedness == found.topology == 1


def test_edges_may_be_given_in_any_way(ring):
    shuffled = np.random.default_rng(0).permutation(np.concatenate([ring.edges, ring.edges[:5, ::-1], [[7, 7]]]))
    one, other = (assess(curve(ring.nodes, edges), ring.points) for edges in (ring.edges, shuffled))
    assert one.as_dict() == other.as_dict()
    assert other.edge_centredness.shape == (len(shuffled),)


def test_nothing_is_modified(ring):
    axis, points = axis_of(ring), ring.points.copy()
    arrays = (axis.vertices, axis.edges, axis.radii, points)
    before = [array.copy() for array in arrays]
    for array in arrays:
        array.flags.writeable = False
    assess(axis, points)
    compare(axis, ring)
    assert all((a == b).all() for a, b in zip(arrays, before, strict=True))


# ---------------------------------------------------------------------------------------------------------- refusals

LINE = [[0, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    ("vertices", "edges", "message"),
    [
        (np.empty((0, 3)), np.empty((0, 2), int), "the skeleton is empty"),
        ([[0, 0, 0], [np.nan, 0, 0]], [[0, 1]], "coordinates that are not finite"),
        (LINE, [[0, 2]], "names a vertex that is not there"),
        (LINE, [[-1, 1]], "names a vertex that is not there"),
    ],
)
def test_skeletons_that_are_none(pipe, vertices, edges, message):
    for measure in (lambda s: compare(s, pipe), lambda s: assess(s, pipe.points)):
        with pytest.raises(InvalidParameterError, match=message):
            measure(curve(vertices, edges))


@pytest.mark.parametrize("vertices", [[[0, 0, 0]], [[1, 1, 1], [1, 1, 1]]])
def test_no_curve_to_assess(pipe, vertices):
    with pytest.raises(InvalidParameterError, match="no edge with a length"):
        assess(curve(vertices), pipe.points)


@pytest.mark.parametrize(("away", "centredness"), [(0, 1), (1, 0), (100, 0)])
def test_points_in_a_row_have_sections_without_a_radius(away, centredness):
    row = np.linspace(LINE[0], LINE[1], 200) + np.cross(np.subtract(*LINE), [1, 2, 3]) * away
    assert assess(curve(LINE), row).centredness == centredness


@pytest.mark.parametrize("cloud", [np.zeros((20, 3)), np.full((20, 3), np.nan), np.eye(3)])
def test_clouds_with_too_few_points(cloud):
    with pytest.raises(InvalidCloudError, match="6 points around"):
        assess(curve(LINE), cloud)


@pytest.mark.parametrize(
    ("nodes", "edges", "radii", "message"),
    [
        (np.empty((0, 3)), np.empty((0, 2), int), [], "no nodes"),
        (LINE, [[0, 1]], [1, 0], "positive, finite radius"),
        (LINE, [[0, 1]], [1, np.inf], "positive, finite radius"),
        (LINE, [[0, 1]], [1], "positive, finite radius"),
        ([[0, 0, np.inf], [1, 0, 0]], [[0, 1]], [1, 1], "not finite"),
        (LINE, [[0, 5]], [1, 1], "not there"),
        (LINE, [[0.5, 1]], [1, 1], "whole numbers"),
        ([[0, 0]], [[0, 1]], [1, 1], "of no use"),
    ],
)
def test_truths_that_are_none(nodes, edges, radii, message):
    with pytest.raises(InvalidParameterError, match=message):
        Truth(nodes, edges, radii)


# ------------------------------------------------------------------------------------------------------------- files


def test_truth_files(ring, tmp_path):
    np.savez(tmp_path / "truth.npz", nodes=ring.nodes, edges=ring.edges, radii=ring.radii, more=1)
    axis = axis_of(ring)
    for name in ("s.npz", "s.json", "s.ply"):
        axis.save(tmp_path / name)
    for path in tmp_path.iterdir():
        assert compare(axis, read_truth(path)).error < 1e-12


def test_files_without_a_truth(ring, tmp_path):
    np.savez(tmp_path / "other.npz", nodes=ring.nodes)
    np.savez(tmp_path / "bad.npz", nodes=ring.nodes, edges=ring.edges, radii=0 * ring.radii)
    axis_of(ring).save(tmp_path / "noradii.obj")
    data = (tmp_path / "bad.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(data[: len(data) // 2])
    (tmp_path / "flipped.npz").write_bytes(data[:200] + bytes([data[200] ^ 255]) + data[201:])
    for path in tmp_path.iterdir():
        with pytest.raises(FileFormatError, match=re.escape(str(path))):
            read_truth(path)
    with pytest.raises(FileNotFoundError, match="no such file"):
        read_truth(tmp_path / "none.npz")


def test_the_example_in_the_documentation(root, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", (root / "docs" / "evaluation.md").read_text(), re.DOTALL)
    exec(compile(code, "docs/evaluation.md", "exec"), {})
    promised = re.findall(r"# prints (.*)", code)
    assert capsys.readouterr().out.splitlines() == promised
    assert promised


def test_without_radii_there_is_no_radius_error(ring):
    axis = Skeleton(ring.nodes, ring.edges, (), (), (), ())
    found = compare(axis, ring)
    assert (found.error, found.radius_error) == (pytest.approx(0, abs=1e-12), None)
