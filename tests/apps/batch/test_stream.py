"""Skeletonizer: the skeletons of a stream are those of its clouds, whoever makes them."""

import os

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import InvalidCloudError, InvalidParameterError, SkeletonWarning, errors, samples, skeletonize
from glsk_o3d.apps.batch import Skeletonizer, stream


@pytest.fixture(scope="module")
def frames():
    return [samples.y_junction(n=600 + 100 * seed, seed=seed).points for seed in range(5)]


def die(*given):
    os._exit(1)


def same(one, other):
    for name in ("vertices", "edges", "radii", "confidence", "vertex_of_point", "points"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    assert one.report.decisions == other.report.decisions


@pytest.mark.parametrize("workers", [1, 2])
def test_gives_the_skeletons_of_its_clouds_in_their_order(frames, workers):
    with Skeletonizer(workers=workers, k=10) as skeletonizer:
        for _ in range(2):  # a second stream is as the first
            found = list(skeletonizer.stream(iter(frames)))
            assert len(found) == len(frames)
            for skeleton, frame in zip(found, frames, strict=True):
                same(skeleton, skeletonize(frame, k=10))


def test_takes_no_more_clouds_ahead_than_it_has_workers(frames):
    taken = []
    with Skeletonizer(workers=2) as skeletonizer:
        for given, _ in enumerate(skeletonizer.stream(taken.append(0) or frame for frame in frames), 1):
            assert len(taken) <= given + 2


@pytest.mark.parametrize("workers", [1, 2])
def test_what_goes_wrong_is_raised_after_what_went_right(frames, workers):
    def camera():
        yield from frames[:2]
        raise OSError("unplugged")

    few, flat = ([*frames[:2], cloud, frames[2]] for cloud in (np.zeros((5, 3)), np.zeros((50, 2))))
    with Skeletonizer(workers=workers) as skeletonizer:
        for clouds, error in ((few, InvalidCloudError), (flat, InvalidCloudError), (camera(), OSError)):
            found = skeletonizer.stream(clouds)
            for frame in frames[:2]:
                same(next(found), skeletonize(frame))
            with pytest.raises(error):
                next(found)


def test_counts_of_a_sample_are_sent(frames):
    sample = o3d.t.geometry.PointCloud(o3d.core.Tensor(frames[0]))
    sample.point["sample_count"] = o3d.core.Tensor(np.arange(1, 601))
    with Skeletonizer(workers=2) as skeletonizer:
        (found,) = skeletonizer.stream([sample])
    same(found, skeletonize(sample))
    assert found.report.n_input == 600 * 601 // 2


def test_one_that_is_closed_says_so(frames):
    skeletonizer = Skeletonizer(workers=2)
    found = skeletonizer.stream(frames)
    next(found)
    skeletonizer.close()
    with pytest.raises(errors.BatchError, match="closed"):
        list(found)


def test_warnings_are_heard():
    ball = samples.sphere(n=800).points
    with Skeletonizer(workers=2) as skeletonizer, pytest.warns(SkeletonWarning, match="sphere-like"):
        list(skeletonizer.stream([ball]))


def test_a_process_that_dies_is_named(frames, monkeypatch):
    monkeypatch.setattr(stream, "_skeletonized", die)
    with Skeletonizer(workers=2) as skeletonizer, pytest.raises(errors.BatchError, match="died"):
        list(skeletonizer.stream(frames))


@pytest.mark.parametrize(("given", "words"), [({"workers": 0}, "workers = 0"), ({"kk": 3}, "kk")])
def test_wrong_arguments_are_named(given, words):
    with pytest.raises(InvalidParameterError, match=words):
        Skeletonizer(**given)
