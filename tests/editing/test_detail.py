"""The detail of a skeleton is turned up and down after the run."""

from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest

from glsk_o3d import InvalidParameterError, editing, read_skeleton, save_skeleton, skeletonize
from glsk_o3d.samples import torus, y_junction
from glsk_o3d.samples.capsules import union_sample
from glsk_o3d.skeleton import Skeleton


@pytest.fixture(scope="module")
def stout():
    """A thick body with legs, the shortest of which is no limb for the Refiner."""
    nodes, edges = [[-0.5, 0, 0], [0.5, 0, 0]], [[0, 1]]
    for (x, y), reach in zip(product((-0.35, 0.35), (-0.2, 0.2)), (0.1, 0.2, 0.3, 0.5), strict=True):
        edges.append([len(nodes), len(nodes) + 1])
        nodes += [[x, 0, 0], [x, y, -0.25 - reach]]
    radii = np.repeat([0.35, 0.1], [2, 8])
    return skeletonize(union_sample("", np.array(nodes), np.array(edges), radii, 4096, 0.0, 0).points)


def same(one: Skeleton, other: Skeleton) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("vertices", "edges", "radii"))


def test_more_ends_the_less_is_asked(stout):
    ends = [len(editing.detailed(stout, limb=limb).leaves) for limb in (0, 0.1, 0.3, 0.5, 0.7, 0.9, 1)]
    assert all(more >= less for more, less in pairwise(ends))
    assert ends[0] > len(stout.leaves) > ends[-1] == 2
    assert same(editing.detailed(stout, limb=0.5), stout)


def test_what_goes_comes_back(stout):
    for limb in (0, 0.3, 0.9, 1):
        there = editing.detailed(stout, limb=limb)
        back = editing.detailed(there, limb=0.5)
        assert len(back.leaves) == len(stout.leaves)
        for one, other in ((back, stout), (stout, back)):  # vertices may have other numbers
            away = np.linalg.norm(one.vertices[:, None] - other.vertices, axis=2).min(axis=1)
            np.testing.assert_array_equal(away, 0)
        assert back.length == pytest.approx(stout.length)
        limbs = [it for it in there.report.decisions if it.about == "limb"]
        assert not any(it.changed for it in limbs if it.probability >= limb)  # of others the last two ends stay


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


def test_files_keep_it(stout, tmp_path):
    for name in ("stout.json", "stout.npz"):
        save_skeleton(stout, tmp_path / name)
        read = read_skeleton(tmp_path / name)
        assert read.report.decisions == stout.report.decisions
        assert same(editing.detailed(read, limb=0), editing.detailed(stout, limb=0))


def test_what_nobody_asked_about_stays():
    ring, junction = skeletonize(torus(1000).points), skeletonize(y_junction(1500).points)
    assert same(editing.detailed(ring, limb=1), ring)
    unasked = skeletonize(y_junction(1500).points, limb=0)
    for skeleton in (unasked, replace(junction, report=replace(junction.report, decisions=()))):
        for limb in (0, 1):
            assert same(editing.detailed(skeleton, limb=limb), skeleton)


def test_limbs_alike_are_judged_one_by_one(stout):
    """Also if their probabilities are the same number."""
    alike = [
        replace(it, probability=0.6) if it.about == "limb" else it for it in stout.report.decisions if not it.changed
    ]
    skeleton = replace(stout, report=replace(stout.report, decisions=tuple(alike)))
    assert len(editing.detailed(skeleton, limb=0.7).leaves) == 2


@pytest.mark.parametrize("limb", [-0.1, 1.5, np.nan, "much"])
def test_a_probability_lies_between_0_and_1(stout, limb):
    with pytest.raises(InvalidParameterError, match="limb"):
        editing.detailed(stout, limb=limb)
