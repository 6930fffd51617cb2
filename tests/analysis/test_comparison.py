"""`compare` on closed forms; against the yardstick that is not in the repository, where it is there."""

import importlib.util
from types import SimpleNamespace

import numpy as np
import pytest

from glsk_o3d.analysis import Truth, compare
from glsk_o3d.samples import helix, sample_object, sphere, torus, tube, two_rings, y_junction
from glsk_o3d.skeleton import Skeleton

SAMPLES = [tube, torus, helix, y_junction, two_rings, sample_object]


@pytest.mark.parametrize("make", SAMPLES)
def test_the_axis_itself(make, axis_of):
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
def test_a_shift_is_an_error_of_as_many_radii(d, axis_of):
    sample = tube(100, radius=0.1)
    found = compare(axis_of(sample, shift=[0, d, 0]), sample)
    assert found.error == pytest.approx(d / 0.1, rel=1e-12)
    assert found.ends == pytest.approx(d / 0.1, rel=1e-12)
    assert found.inside == found.completeness == (d < 0.1)
    np.testing.assert_allclose(found.edge_error, d / 0.1)


def test_half_of_the_axis(curve):
    sample = tube(100, length=4, radius=0.01)
    found = compare(curve([[-2, 0, 0], [0, 0, 0]]), sample)
    assert found.completeness == pytest.approx(0.5 + 0.01 / 4, abs=0.001 / 4)  # and one radius more
    assert (found.error, found.inside) == (pytest.approx(0, abs=1e-12), 1)
    assert found.ends == pytest.approx((0 + 2 / 0.01) / 2)


def test_errors_are_in_the_radius_nearby(curve):
    cone = Truth([[0, 0, 0], [1, 0, 0]], [[0, 1]], [0.1, 0.3])
    found = compare(curve([[0, 0.1, 0], [1, 0.1, 0]]), cone)
    assert found.error == pytest.approx(0.1 / 0.2 * np.log(3), rel=1e-3)  # the mean of 0.1 / (0.1 + 0.2 x)


def test_radii_are_interpolated(pipe, curve):
    vertices = [[-0.5, 0, 0], [0.5, 0, 0]]
    assert compare(curve(vertices, radii=[0.1, 0.3]), pipe).radius_error == pytest.approx(1, rel=1e-12)
    assert compare(curve(vertices, radii=[0.05, 0.05]), pipe).radius_error == pytest.approx(0.5)
    assert compare(curve(vertices), pipe).radius_error is None
    known = curve([*vertices, [0.5, 0, 0.1]], radii=[0.2, 0.2, np.nan])
    assert compare(known, pipe).radius_error == pytest.approx(1)


def test_structure_is_counted(ring, curve):
    open_ring = compare(curve(ring.nodes), ring)
    assert (open_ring.components, open_ring.loops, open_ring.leaves, open_ring.junctions) == (0, -1, 2, 0)
    assert not open_ring.topology
    twice = compare(curve([*ring.nodes, [0, 0, 0]], np.concatenate([ring.edges, ring.edges[:, ::-1]])), ring)
    assert (twice.components, twice.loops, twice.leaves) == (1, 0, 0)  # repeated edges are none; one vertex is alone
    assert not twice.topology
    hair = compare(curve([*ring.nodes, [0.5, 0, 0]], [*ring.edges.tolist(), [0, len(ring.nodes)]]), ring)
    assert (hair.leaves, hair.junctions, hair.topology) == (1, 1, True)


def test_a_ball_has_one_node(curve):
    ball = sphere(100, radius=0.5)
    found = compare(curve([[0.1, 0, 0]], np.empty((0, 2), int)), ball)
    assert (found.error, found.inside, found.completeness) == (pytest.approx(0.2), 1, 1)
    assert (found.ends, found.topology, found.edge_error.shape) == (None, True, (0,))


def test_a_skeleton_without_leaves_ends_at_its_nearest_vertex(ring, axis_of):
    straight = Truth([[0.9, 0, 0], [2, 0, 0]], [[0, 1]], [0.1, 0.2])
    assert compare(axis_of(ring), straight).ends == pytest.approx((5 + 8) / 2)


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_units_and_places_do_not_matter(scale, curve):
    sample = sample_object(100)
    bent = curve(sample.nodes + 0.02 * np.sin(40 * sample.nodes[:, ::-1]), sample.edges, 0.9 * sample.radii)
    there = Truth(sample.nodes * scale + scale, sample.edges, sample.radii * scale)
    moved = curve(bent.vertices * scale + scale, bent.edges, bent.radii * scale)
    expected, found = compare(bent, sample).as_dict(), compare(moved, there).as_dict()
    assert found == pytest.approx(expected, rel=1e-6)
    assert expected["error"] > 0.05


@pytest.mark.parametrize("name", ["bent_tube", "double_torus", "ladder", "quadruped", "sphere", "tree2", "two"])
def test_agrees_with_the_yardstick(shared_dir, name, curve):
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
        shared = found.keys() & expected.keys()
        found, expected = ({key: its[key] for key in shared} for its in (found, expected))
        assert found == pytest.approx(expected, abs=1e-12, rel=1e-12)


def test_without_radii_there_is_no_radius_error(ring):
    axis = Skeleton(ring.nodes, ring.edges, (), (), (), ())
    found = compare(axis, ring)
    assert (found.error, found.radius_error) == (pytest.approx(0, abs=1e-12), None)
