"""Shapes and clouds are those of the program that the benchmark was first drawn with, to the last bit.

But for the order in which that one picks points, which differs between processors.
"""

import importlib.util

import numpy as np
import pytest
from glsk_bench.clouds import VARIANTS, cloud, coverage
from glsk_bench.shapes import FAMILIES


@pytest.fixture(scope="module")
def zoo(shared_dir):
    spec = importlib.util.spec_from_file_location("zoo", shared_dir / "zoo.py")
    spec.loader.exec_module(module := importlib.util.module_from_spec(spec))

    def draw(weights, n, rng):
        fit = np.flatnonzero(weights > 0)
        return fit[np.argsort(-np.log(weights[fit]) - rng.gumbel(size=len(fit)), kind="stable")[:n]]

    theirs = module.draw
    for n in (1, 300):  # the same points
        weights = np.random.default_rng(n).integers(0, 3, 1000)
        given = (theirs(weights, n, np.random.default_rng(0)), draw(weights, n, np.random.default_rng(0)))
        np.testing.assert_array_equal(*map(np.sort, given))
    module.draw = draw
    return module


def test_there_is_the_same_to_choose_from(zoo):
    assert (tuple(zoo.FAMILIES), zoo.VARIANTS) == (FAMILIES, VARIANTS)


@pytest.mark.parametrize(("family", "seed"), [(family, 3 + place) for place, family in enumerate(FAMILIES)])
def test_shapes_and_clouds_agree(family, seed, zoo, drawn):
    ours, theirs = drawn(family, seed), zoo.shape(family, seed)
    arrays = ("nodes", "edges", "radii", "points", "normals")
    for name in arrays:
        np.testing.assert_array_equal(getattr(ours, name), theirs.pop(name))
    assert ours.facts == theirs
    theirs |= {name: getattr(ours, name) for name in arrays}
    for variant in VARIANTS:
        points = cloud(ours, variant, 1024, 1)
        np.testing.assert_array_equal(points, zoo.cloud(theirs, variant, 1024, 1))
        if variant in ("holes", "scan2"):
            assert coverage(ours, points) == zoo.coverage(theirs, points)
