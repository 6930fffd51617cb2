"""What is fixed for ever, and what tells clouds apart."""

import json

import numpy as np
import pytest
from glsk_bench import versions
from glsk_bench.shapes import FAMILIES
from glsk_bench.versions import fingerprint, fingerprints, sameness, version


@pytest.fixture
def points():
    return np.random.default_rng(0).uniform(-0.5, 0.5, (4096, 3)).astype(np.float32)


def test_the_first_version_never_changes():
    first = version("v1")
    assert first.families == ("tubes", "trees", "frames", "figures", "handles", "groups")
    assert first.seeds == (100, 101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111)
    assert " ".join(first.variants) == "clean density holes outliers noise05 noise1 noise2 scan2 depth2 misreg lidar"
    assert (first.points, first.draw, first.least_coverage) == (4096, 0, 0.97)
    assert " ".join(first.whole) == "clean outliers noise05 noise1 noise2"


def test_the_third_version_is_the_second_and_more():
    second, third = version("v2"), version("v3")
    assert third.families == (*second.families, "toys", "rings")
    assert third.variants == (*second.variants, "flying")
    assert (third.seeds, third.points, third.draw, third.left_out) == (second.seeds, 4096, 0, ("plates_110_depth2",))
    assert (second.steady, third.steady) == (False, True)
    assert sorted(FAMILIES) == ["v1", "v2", "v3"]
    assert all(FAMILIES[name] == version(name).families for name in FAMILIES)
    known = [fingerprints(name) for name in ("v2", "v3")]
    shared = known[0].keys() - {name for name in known[0] if name.startswith("animals")}
    assert all(known[0][name] == known[1][name] for name in shared)


def test_what_a_fingerprint_is_never_changes(points):
    assert fingerprint(np.zeros((2, 3))) == "9d908ecf 0 0"  # SHA-256 of 24 zeros
    assert fingerprint(np.arange(12.0).reshape(4, 3)).split()[1:] == ["82249263", "837992698"]
    assert fingerprint(points) == fingerprint(points.astype(float)) == fingerprint(np.asfortranarray(points))


@pytest.mark.parametrize("seed", range(2))
def test_roundings_are_told_from_other_clouds(points, seed):
    known, rng = fingerprint(points), np.random.default_rng(seed)
    assert sameness(points, known) == "bits"
    there = np.where(rng.random(points.shape) < 0.5, -np.inf, np.inf).astype(np.float32)
    assert sameness(np.nextafter(points, there), known) == "rounding"
    one = points.copy()
    one[7, 1] = np.nextafter(one[7, 1], np.float32(1))
    assert sameness(one, known) == "rounding"
    moved, swapped, pair = points.copy(), points.copy(), rng.choice(4096, 2, replace=False)
    moved[rng.integers(4096)] = rng.uniform(-0.5, 0.5, 3)
    swapped[pair] = swapped[pair[::-1]]
    assert sameness(moved, known) == sameness(swapped, known) == sameness(points[::-1], known) == "other"


def test_what_is_scored_is_fixed_for_the_clouds_that_are_known(tmp_path, monkeypatch):
    monkeypatch.setattr(versions, "_file", lambda name: tmp_path / f"{name}.json")
    versions.write_fingerprints("v1", {"trees_7": {"clean": "b 3 4", "lidar": "c 5 6"}}, ["trees_7_lidar"])
    asked = version("v1")
    assert [versions.is_scored(asked, "trees_7_clean", share) for share in (0.9699, 0.97)] == [True, True]
    assert [versions.is_scored(asked, "trees_7_lidar", share) for share in (0.9699, 0.97)] == [False, False]
    assert [versions.is_scored(asked, "trees_8_clean", share) for share in (0.9699, 0.97)] == [False, True]
    assert fingerprints("v1") == {"trees_7_clean": "b 3 4", "trees_7_lidar": "c 5 6"}


def test_the_package_knows_all_clouds_of_a_version_or_none():
    for asked in versions.VERSIONS.values():
        known = fingerprints(asked.name)
        shapes = [f"{family}_{seed}" for family in asked.families for seed in asked.seeds]
        names = [f"{shape}_{each}" for shape in shapes for each in asked.variants_of(shape)]
        assert not known or sorted(known) == sorted(names)
        assert len(json.dumps(known)) < 70_000
