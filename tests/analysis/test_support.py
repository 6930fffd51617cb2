"""Support by resampling: what other samples show is known for skeletons that are drawn."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from glsk_o3d import (
    InvalidParameterError,
    Report,
    Skeleton,
    SkeletonWarning,
    Supported,
    read_skeleton,
    samples,
    save_skeleton,
    skeletonize,
    support,
)
from glsk_o3d.analysis import branch_table
from glsk_o3d.analysis.support import _supported

R = 0.1
STEP = R / 2


def drawn(*paths):
    """A skeleton of polylines, of radius R all along; places that are equal are one vertex."""
    known, edges = {}, set()
    for path in paths:
        places = []
        for a, b in pairwise(np.array(path, float)):
            n = round(np.linalg.norm(b - a) / STEP)
            places += [a + k / n * (b - a) for k in range(n + 1)]
        row = [known.setdefault(tuple(place.round(6)), len(known)) for place in places]
        edges |= {(min(pair), max(pair)) for pair in pairwise(row) if pair[0] != pair[1]}
    return Skeleton(list(known), sorted(edges), np.full(len(known), R), (), (), ())


STEM = [(0, 0, 0), (0, 0, 2)]
TWIG = [(0, 0, 1), (1, 0, 1)]
RING = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0)]
SPLIT = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0.4, 1, 0)]  # the ring, open over four radii


def shares(skeleton, about, present=True):
    return sorted(it.share for it in skeleton.report.support if it.about == about and it.present is present)


@pytest.mark.filterwarnings("ignore:uncertain")
@pytest.mark.parametrize("shift", [0, 0.5 * R])
def test_a_limb_has_the_share_of_the_samples_that_show_it(shift):
    plain, forked = drawn(STEM), drawn(STEM, TWIG)
    others = [replace(each, vertices=each.vertices + [0, shift, 0]) for each in (forked, forked, forked, plain)]
    found = _supported(forked, others)
    assert shares(found, "branch") == [0.75, 1, 1]
    assert shares(found, "end") == [0.75, 1, 1]
    assert not any(not it.present for it in found.report.support)
    tip, foot = (np.argmin(np.linalg.norm(found.vertices - place, axis=1)) for place in ([1, 0, 1], [0, 0, 0]))
    assert (found.support[tip], found.support[foot]) == (0.75, 1)
    assert found.report.n_agreeing == 3
    table = branch_table(found)
    assert sorted(table.support) == [0.75, 1, 1]


@pytest.mark.filterwarnings("ignore:uncertain")
def test_what_a_skeleton_lacks_is_told_once():
    plain, forked = drawn(STEM), drawn(STEM, TWIG)
    with pytest.warns(SkeletonWarning, match=r"3 of 4 samples .* end at \(1, 0, 1\), which 75 % .* does not"):
        found = _supported(plain, [forked, plain, forked, forked])
    assert shares(found, "end", present=False) == [0.75]
    (missing,) = (it for it in found.report.unsupported if not it.present)
    np.testing.assert_allclose(missing.place, (1, 0, 1))
    assert shares(found, "branch") == [1]


@pytest.mark.filterwarnings("ignore:uncertain")
def test_a_loop_is_shown_by_a_loop_alone():
    """Not by the same curve with a gap, nor by a loop elsewhere."""
    ring, split = drawn(RING), drawn(SPLIT)
    far = replace(ring, vertices=ring.vertices + [0.5, 0, 0])
    found = _supported(ring, [ring, split, split, far])
    assert shares(found, "loop") == [0.25]
    assert shares(found, "loop", present=False) == [0.25]
    assert shares(_supported(split, [ring, ring, split, split]), "loop", present=False) == [0.5]


@pytest.mark.slow
def test_a_clear_shape_is_certain(recwarn):
    calls, points = [], samples.y_junction(1200).points
    found = support(points, draws=3, on_draw=lambda *n: calls.append(n))
    assert calls == [(1, 3), (2, 3), (3, 3)]
    assert found.support.min() == 1
    assert (found.report.n_draws, found.report.n_agreeing, found.report.unsupported) == (3, 3, ())
    assert not recwarn.list
    plain = skeletonize(points)
    np.testing.assert_array_equal(found.vertices, plain.vertices)
    assert np.isnan(plain.support).all()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:uncertain")
def test_options_seeds_and_files(tmp_path):
    points = samples.torus(1000).points
    found = support(points, draws=2, k=20, seed=7)
    assert support(points, 2, {"k": 20}, seed=7).report.support == found.report.support
    for name in ("ring.json", "ring.npz"):
        save_skeleton(found, tmp_path / name)
        again = read_skeleton(tmp_path / name)
        np.testing.assert_array_equal(again.support, found.support)
        assert again.report.support == found.report.support


@pytest.mark.parametrize("draws", [1, 0, -3, 2.0, True, "8"])
def test_numbers_of_samples(draws):
    """Before anything is computed."""
    with pytest.raises(InvalidParameterError, match=r"draws = .*: must be (an int|at least 2)"):
        support(None, draws)


def test_what_others_show_is_well_supported_or_not():
    assert not Supported("end", (0.0, 0.0, 0.0), 0.5, present=False).is_well_supported
    assert Supported("end", (0.0, 0.0, 0.0), 0.125, present=False).is_well_supported
    with pytest.raises(ValueError, match="share"):
        Report.from_dict({"support": [{"about": "end", "place": [0, 0, 0], "share": "much"}]})
