"""The loops of a skeleton, and how probable it is that they are handles."""

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest

from glsk_o3d import Skeleton, read_skeleton, samples, save_skeleton, skeletonize
from glsk_o3d.analysis import Loop, find_loops


@pytest.fixture(scope="module")
def rings():
    return skeletonize(samples.two_rings(2000).points)


def test_a_ring_is_one_loop_as_surely_a_handle_as_it_was_judged():
    skeleton = skeletonize(samples.torus(1500).points)
    (loop,) = find_loops(skeleton)
    assert isinstance(loop, Loop)
    assert loop.opening == pytest.approx(0.4, rel=0.03)
    (judged,) = (it for it in skeleton.report.decisions if it.about == "loop")
    assert loop.probability == pytest.approx(judged.probability, abs=0.02)
    assert loop.probability > 0.9
    assert sorted(loop.vertices.tolist()) == list(range(len(skeleton.vertices)))
    closed = np.sort(np.column_stack([loop.vertices, np.roll(loop.vertices, -1)]), axis=1)
    np.testing.assert_array_equal(np.unique(closed, axis=0), skeleton.edges)


def test_as_many_as_there_are(rings, loop):
    assert len(find_loops(rings)) == rings.n_loops == 2
    assert len(find_loops(loop)) == loop.n_loops == 2
    for it in find_loops(loop):
        assert nx.is_path(loop.to_networkx(), [*it.vertices.tolist(), int(it.vertices[0])])


def test_nobody_knows_without_points_normals_or_confidence(rings):
    nothing = np.empty((0, 3))
    for unknown in (
        replace(rings, points=nothing, normals=nothing, vertex_of_point=[]),
        replace(rings, normals=np.full_like(rings.normals, np.nan)),
        replace(rings, confidence=[]),
    ):
        assert len(find_loops(unknown)) == 2
        assert np.isnan([it.probability for it in find_loops(unknown)]).all()
        np.testing.assert_array_equal(
            [it.opening for it in find_loops(unknown)], [it.opening for it in find_loops(rings)]
        )


@pytest.mark.parametrize(("ending", "known"), [("json", True), ("npz", True), ("obj", False)])
def test_from_files(rings, tmp_path, ending, known):
    save_skeleton(rings, tmp_path / f"s.{ending}")
    again = find_loops(read_skeleton(tmp_path / f"s.{ending}"))
    assert len(again) == 2
    assert [np.isfinite(it.probability) for it in again] == [known, known]


def test_trees_dots_and_nothing_have_none(tree, dot):
    assert find_loops(tree) == find_loops(dot) == find_loops(Skeleton([], [], [], [], [], [])) == ()
