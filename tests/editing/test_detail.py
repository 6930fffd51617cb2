"""The detail of a skeleton is raised and lowered after the run."""

from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest

from glsk_o3d import (
    FileFormatError,
    InvalidParameterError,
    editing,
    pipelines,
    read_skeleton,
    samples,
    save_skeleton,
    skeletonize,
)
from glsk_o3d.data.decisions import Decision
from glsk_o3d.data.skeleton import Skeleton
from glsk_o3d.samples.capsules import union_sample


@pytest.fixture(scope="module")
def stout():
    """A thick body with legs, the shortest of which is no limb for the Refiner."""
    nodes, edges = [[-0.5, 0, 0], [0.5, 0, 0]], [[0, 1]]
    for (x, y), reach in zip(product((-0.35, 0.35), (-0.2, 0.2)), (0.06, 0.2, 0.3, 0.5), strict=True):
        edges.append([len(nodes), len(nodes) + 1])
        nodes += [[x, 0, 0], [x, y, -0.25 - reach]]
    radii = np.repeat([0.35, 0.1], [2, 8])
    return skeletonize(union_sample("", np.array(nodes), np.array(edges), radii, 4096, 0.0, 0).points)


def same(one: Skeleton, other: Skeleton) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("vertices", "edges", "radii"))


def test_a_lower_probability_gives_more_ends(stout):
    ends = [len(editing.detailed(stout, limb=limb).leaves) for limb in (0, 0.1, 0.3, 0.5, 0.7, 0.9, 1)]
    assert all(more >= less for more, less in pairwise(ends))
    assert ends[0] > len(stout.leaves) > ends[-1] == 2
    assert same(editing.detailed(stout, limb=0.5), stout)


def test_dropped_limbs_come_back(stout):
    for limb in (0, 0.3, 0.9, 1):
        other = editing.detailed(stout, limb=limb)
        back = editing.detailed(other, limb=0.5)
        assert len(back.leaves) == len(stout.leaves)
        assert set(map(tuple, back.vertices.tolist())) == set(map(tuple, stout.vertices.tolist()))
        assert back.length == pytest.approx(stout.length)
        limbs = [decision for decision in other.report.decisions if decision.about == "limb"]
        assert not any(it.changed for it in limbs if it.probability >= limb)  # of others the last two ends stay


@pytest.mark.parametrize("seed", range(4))
def test_all_and_none_and_back(seed):
    """A certain limb does not go with a weak one beyond its junction."""
    rng = np.random.default_rng(seed)
    nodes, edges = [[0.0, 0, 0], [1, 0, 0]], [(0, 1)]
    for _ in range(12):  # each branch from a vertex that has two edges
        free = np.flatnonzero(np.bincount(np.ravel(edges)) == 2)
        start = int(rng.choice(free)) if len(free) else 1
        path = np.array(nodes[start]) + np.cumsum(rng.normal(size=(3, 3)), axis=0)
        edges += [(start, len(nodes)), (len(nodes), len(nodes) + 1), (len(nodes) + 1, len(nodes) + 2)]
        nodes += path.tolist()
    plain = Skeleton(nodes, edges, np.full(len(nodes), 0.1), (), (), ())
    chances = rng.permutation(len(plain.leaves)) / len(plain.leaves) * 0.4 + 0.55
    tips = map(tuple, plain.vertices[plain.leaves].tolist())
    decisions = tuple(Decision("limb", tip, chance, False) for tip, chance in zip(tips, chances.tolist(), strict=True))
    skeleton = replace(plain, report=replace(plain.report, decisions=decisions))
    for limb in (0.6, 0.8, 1.0):
        back = editing.detailed(editing.detailed(skeleton, limb=limb), limb=0.5)
        assert len(back.leaves) == len(skeleton.leaves)
        assert back.length == pytest.approx(skeleton.length)
    kept = {it.place for it in editing.detailed(skeleton, limb=0.75).report.decisions if not it.changed}
    assert kept >= {it.place for it in decisions if it.probability >= 0.75}


def test_a_root_stays():
    tree = pipelines.tree()(samples.tree(4000, forks=3).points)
    bare = editing.detailed(tree, limb=1)
    assert len(bare.leaves) < len(tree.leaves)
    np.testing.assert_array_equal(bare.vertices[0], tree.vertices[0])
    assert bare.report.root == tuple(bare.vertices[0].tolist())


@pytest.mark.parametrize(
    "wrong",
    [
        dict(probability=1.5),
        dict(probability=float("nan")),
        dict(place=(0.0, float("inf"), 0.0)),
        dict(branch=((0.0, 0.0, 0.0),), radii=(1.0,)),
        dict(branch=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), radii=(1.0,)),
        dict(branch=((0.0, 0.0, 0.0), (1e300, 0.0, 0.0)), radii=(1.0, 1.0)),
        dict(branch=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), radii=(1.0, -1.0)),
    ],
)
def test_files_with_impossible_decisions_are_refused(stout, tmp_path, wrong):
    first, *others = stout.report.decisions
    report = replace(stout.report, decisions=(replace(first, **wrong), *others))
    save_skeleton(replace(stout, report=report), tmp_path / "wrong.json")
    with pytest.raises(FileFormatError, match="decision"):
        read_skeleton(tmp_path / "wrong.json")


def test_a_branch_that_comes_back_has_its_points_and_radius(stout):
    whole = editing.detailed(stout, limb=0)
    more = np.arange(len(stout.vertices), len(whole.vertices))
    assert np.isfinite(whole.radii[more]).all()
    assert np.isnan(whole.confidence[more]).all()
    theirs = np.isin(whole.vertex_of_point, more)
    assert theirs.sum() > 20
    distance = np.linalg.norm(whole.points - whole.vertices[whole.vertex_of_point], axis=1)
    before = np.linalg.norm(stout.points - stout.vertices[stout.vertex_of_point], axis=1)
    assert (distance[theirs] < before[theirs]).all()
    np.testing.assert_array_equal(whole.vertex_of_point[~theirs], stout.vertex_of_point[~theirs])


def test_files_keep_decisions(stout, tmp_path):
    for name in ("stout.json", "stout.npz"):
        save_skeleton(stout, tmp_path / name)
        read = read_skeleton(tmp_path / name)
        assert read.report.decisions == stout.report.decisions
        assert same(editing.detailed(read, limb=0), editing.detailed(stout, limb=0))


@pytest.mark.parametrize("limb", [-0.1, 1.5, np.nan, "much"])
def test_a_probability_lies_between_0_and_1(stout, limb):
    with pytest.raises(InvalidParameterError, match="limb"):
        editing.detailed(stout, limb=limb)
