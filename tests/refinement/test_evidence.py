"""What the surface around a skeleton says: normals outward, inside and outside, areas, bonds."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Skeleton, skeletonize
from glsk_o3d.refinement.evidence import Evidence
from glsk_o3d.samples.capsules import union_sample

X, Y, Z = np.eye(3)
TUBE = [[(-1, 0, 0), (1, 0, 0)]]
TORUS = [[(np.cos(t), np.sin(t), 0) for t in np.arange(25) * np.pi / 12]]
ACROSS = [[(-1, 0, 0), (0, 0, 0), (1, 0, 0)], [(-1, 0.5, 0), (0, 0.5, 0), (1, 0.5, 0)], [(0, 0, 0), (0, 0.5, 0)]]
"""Two parallel tubes, and an edge from one to the other."""


def outward(evidence, lines, radius=0.1):
    """Share of the normals that point away from the lines."""
    ends = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in map(np.asarray, lines)]).astype(float)
    start, step = ends[:, 0], ends[:, 1] - ends[:, 0]
    t = np.einsum("pei,ei->pe", evidence.points[:, None] - start, step) / (step**2).sum(axis=1)
    offset = evidence.points[:, None] - (start + np.clip(t, 0, 1)[:, :, None] * step)
    nearest = np.argmin(np.linalg.norm(offset, axis=2), axis=1)
    away = offset[np.arange(len(nearest)), nearest]
    return (np.einsum("ij,ij->i", evidence.normals, away) > 0).mean()


@pytest.mark.parametrize("lines", [TUBE, TORUS], ids=["tube", "torus"])
@pytest.mark.parametrize("side", [None, Z], ids=["whole", "half"])
def test_normals_point_outward(piped, lines, side):
    evidence = Evidence.of(piped(lines, side=side))
    assert outward(evidence, lines) == 1
    np.testing.assert_allclose(np.linalg.norm(evidence.normals, axis=1), 1)


def test_normals_point_outward_around_a_false_edge(piped):
    evidence = Evidence.of(piped(ACROSS, tubes=[0, 1]))
    assert outward(evidence, ACROSS[:2]) > 0.995


def test_points_without_a_say_are_no_evidence(piped):
    skeleton = piped(TUBE)
    normals, vertex = skeleton.normals.copy(), skeleton.vertex_of_point.copy()
    normals[::3], vertex[1::3] = np.nan, -1
    evidence = Evidence.of(replace(skeleton, normals=normals, vertex_of_point=vertex))
    np.testing.assert_array_equal(evidence.supporting, np.arange(len(normals))[2::3])
    np.testing.assert_array_equal(evidence.points, skeleton.points[2::3])
    assert np.isfinite(evidence.normals).all()


def test_inside_and_outside(piped):
    inside = np.linspace(-0.5, 0.5, 5)[:, None] * X
    evidence = Evidence.of(piped(TUBE))
    np.testing.assert_allclose(evidence.winding(inside), 1, atol=0.1)
    np.testing.assert_allclose(evidence.winding(inside + 0.3 * Z), 0, atol=0.05)
    half = Evidence.of(piped(TUBE, side=Z))
    np.testing.assert_allclose(half.winding(inside), 0.5, atol=0.07)


def test_areas_are_those_of_the_surface(piped):
    skeleton = piped(TUBE)
    evidence = Evidence.of(skeleton)
    assert evidence.areas.sum() == pytest.approx(2 * np.pi * 0.1 * 2, rel=0.15)
    along = evidence.surface_around(skeleton)
    inner = np.abs(skeleton.vertices[skeleton.edges].mean(axis=1)[:, 0]) < 0.8
    assert along.sum() == pytest.approx(evidence.areas.sum(), rel=0.1)
    np.testing.assert_allclose(along[inner], 2 * np.pi * 0.1 * 0.05, rtol=0.5)


def test_hardly_any_surface_has_a_false_edge_for_its_axis(piped):
    skeleton = piped(ACROSS, tubes=[0, 1])
    along = Evidence.of(skeleton).surface_around(skeleton)
    middle = skeleton.vertices[skeleton.edges].mean(axis=1)
    across = (middle[:, 1] > 0.1) & (middle[:, 1] < 0.4)
    assert across.sum() == 6
    assert along[across].sum() < 0.02 * along.sum()


# --------------------------------------------------------------------------------------------------------------- bonds


def grid(n=20):
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    return np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]).astype(float)


def halves(points, normals, owner):
    """Two vertices and an edge; the points belong to either."""
    return Skeleton([[0, 0, -9], [9, 0, -9]], [(0, 1)], [1, 1], owner, points, normals)


def foreign(evidence, owner):
    """How many near pairs of points have two vertices."""
    return (owner[evidence.neighbours[:, 1:]] != owner[:, None]).sum()


def test_every_near_pair_of_a_plane_is_a_whole_bond():
    points = grid()
    owner = (points[:, 0] > 9.5).astype(int)
    skeleton = halves(points, np.tile(Z, (len(points), 1)), owner)
    evidence = Evidence.of(skeleton)
    pairs, weight = evidence.bonds(skeleton)
    assert pairs.tolist() == [[0, 1]]
    assert weight[0] == pytest.approx(foreign(evidence, owner))


@pytest.mark.parametrize("opposite", [1, -1])
def test_sheets_that_face_each_other_have_no_bond(opposite):
    one = grid(8)
    points = np.concatenate([one, one + 0.5 * Z])
    owner = np.repeat([0, 1], len(one))
    skeleton = halves(points, np.where(owner[:, None] == 0, Z, opposite * Z), owner)
    evidence = Evidence.of(skeleton)
    assert foreign(evidence, owner) > 50
    (p, i), near = np.nonzero(owner[evidence.neighbours[:, 1:]] != owner[:, None]), evidence.neighbours[:, 1:]
    offset = points[near[p, i]] - points[p]
    sine = 1 - 0.25 / (offset**2).sum(axis=1)  # squared, between the line and both normals; 0 right across
    assert (sine == 0).sum() > 50
    np.testing.assert_allclose(evidence.bonds(skeleton)[1].sum(), (sine**2).sum())


def test_bonds_join_what_is_side_by_side_in_a_tube_and_not_two_tubes(piped):
    skeleton = piped(ACROSS, tubes=[0, 1])
    pairs, weight = Evidence.of(skeleton).bonds(skeleton)
    assert (pairs[:, 0] < pairs[:, 1]).all()
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    ends = skeleton.vertices[pairs]
    assert weight[np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) < 0.06].min() > 3
    assert weight[np.abs(ends[:, 1, 1] - ends[:, 0, 1]) > 0.4].sum() == 0


@settings(max_examples=40)
@given(st.integers(0, 10**6))
def test_bonds_go_with_the_skeleton(random_skeleton, placed, seed):
    raw = random_skeleton(seed)
    if len(raw.edges) == 0:
        return
    moved, _ = placed(raw, seed, 3, 1)
    (pairs, weight), (same, as_much) = (Evidence.of(each).bonds(each) for each in (raw, moved))
    np.testing.assert_array_equal(pairs, same)
    np.testing.assert_allclose(weight, as_much, atol=1e-9)


@pytest.mark.filterwarnings("ignore:uncertain topology")  # one of a hundred questions may be a close call
@pytest.mark.parametrize(("rungs", "points"), [(8, 16000), (28, 50000)])
def test_an_object_of_many_parts_keeps_them_however_many_there_are(rungs, points):
    """What is enough for a figure leaves a ladder's rungs a few points each, and no inside."""
    height = 0.3 * np.arange(rungs)
    nodes = np.concatenate([np.column_stack([np.full(rungs, x), np.zeros(rungs), height]) for x in (0, 0.4)])
    up = np.column_stack([np.arange(rungs - 1), np.arange(1, rungs)])
    edges = np.concatenate([up, up + rungs, np.column_stack([np.arange(rungs), rungs + np.arange(rungs)])])
    ladder = union_sample("ladder", nodes, edges, np.full(2 * rungs, 0.025), points, 0, 0)
    skeleton = skeletonize(ladder.points)
    assert (skeleton.n_loops, skeleton.n_components) == (rungs - 1, 1)
    assert not (skeleton.degree == 1).any()
