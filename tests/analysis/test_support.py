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
    number_of, edges = {}, set()
    for path in paths:
        places = []
        for a, b in pairwise(np.array(path, float)):
            n = round(np.linalg.norm(b - a) / STEP)
            places += [a + k / n * (b - a) for k in range(n + 1)]
        row = [number_of.setdefault(tuple(place.round(6)), len(number_of)) for place in places]
        edges |= {(min(pair), max(pair)) for pair in pairwise(row) if pair[0] != pair[1]}
    return Skeleton(list(number_of), sorted(edges), np.full(len(number_of), R), (), (), ())


STEM = [(0, 0, 0), (0, 0, 2)]
TWIG = [(0, 0, 1), (1, 0, 1)]
RING = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0)]
SPLIT = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0.4, 1, 0)]  # the ring, open over four radii


def shares(skeleton, about, present=True):
    return sorted(part.share for part in skeleton.report.support if (part.about, part.present) == (about, present))


@pytest.mark.filterwarnings("ignore:uncertain")
@pytest.mark.parametrize("shift", [0, 0.5 * R])
def test_a_limb_has_the_share_of_the_samples_that_show_it(shift):
    plain, forked = drawn(STEM), drawn(STEM, TWIG)
    others = [replace(other, vertices=other.vertices + [0, shift, 0]) for other in (forked, forked, forked, plain)]
    supported = _supported(forked, others)
    assert shares(supported, "branch") == shares(supported, "end") == [0.75, 1, 1]
    assert all(part.present for part in supported.report.support)
    tip, foot = (np.argmin(np.linalg.norm(supported.vertices - place, axis=1)) for place in ([1, 0, 1], [0, 0, 0]))
    assert (supported.support[tip], supported.support[foot]) == (0.75, 1)
    assert supported.report.n_agreeing == 3
    assert sorted(branch_table(supported).support) == [0.75, 1, 1]


@pytest.mark.filterwarnings("ignore:uncertain")
def test_a_missing_end_is_reported_once():
    plain, forked = drawn(STEM), drawn(STEM, TWIG)
    with pytest.warns(SkeletonWarning, match=r"3 of 4 samples .* end at \(1, 0, 1\), which 75 % .* does not"):
        supported = _supported(plain, [forked, plain, forked, forked])
    assert shares(supported, "end", present=False) == [0.75]
    (missing,) = (part for part in supported.report.unsupported if not part.present)
    np.testing.assert_allclose(missing.place, (1, 0, 1))
    assert shares(supported, "branch") == [1]


@pytest.mark.filterwarnings("ignore:uncertain")
def test_a_loop_is_shown_by_a_loop_alone():
    """Not by the same curve with a gap, nor by a loop elsewhere."""
    ring, split = drawn(RING), drawn(SPLIT)
    far = replace(ring, vertices=ring.vertices + [0.5, 0, 0])
    supported = _supported(ring, [ring, split, split, far])
    assert shares(supported, "loop") == shares(supported, "loop", present=False) == [0.25]
    assert shares(_supported(split, [ring, ring, split, split]), "loop", present=False) == [0.5]


@pytest.mark.slow
def test_a_clear_shape_is_certain(recwarn):
    calls, points = [], samples.y_junction(1200).points
    certain = support(points, draws=3, on_draw=lambda *n: calls.append(n))
    assert calls == [(1, 3), (2, 3), (3, 3)]
    assert certain.support.min() == 1
    assert (certain.report.n_draws, certain.report.n_agreeing, certain.report.unsupported) == (3, 3, ())
    assert not recwarn.list
    plain = skeletonize(points)
    np.testing.assert_array_equal(certain.vertices, plain.vertices)
    assert np.isnan(plain.support).all()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:uncertain")
def test_options_seeds_and_files(tmp_path):
    points = samples.torus(1000).points
    supported = support(points, draws=2, k=20, seed=7)
    assert support(points, 2, {"k": 20}, seed=7).report.support == supported.report.support
    for name in ("ring.json", "ring.npz"):
        save_skeleton(supported, tmp_path / name)
        read = read_skeleton(tmp_path / name)
        np.testing.assert_array_equal(read.support, supported.support)
        assert read.report.support == supported.report.support


@pytest.mark.parametrize("draws", [1, 0, -3, 2.0, True, "8"])
def test_at_least_two_samples(draws):
    """Checked before anything is computed."""
    with pytest.raises(InvalidParameterError, match="draws"):
        support(None, draws)


def test_what_others_show_is_well_supported_or_not():
    assert not Supported("end", (0.0, 0.0, 0.0), 0.5, present=False).is_well_supported
    assert Supported("end", (0.0, 0.0, 0.0), 0.125, present=False).is_well_supported
    with pytest.raises(ValueError, match="share"):
        Report.from_dict({"support": [{"about": "end", "place": [0, 0, 0], "share": "much"}]})
