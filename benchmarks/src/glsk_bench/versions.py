"""The versions of the benchmark, fixed for ever, and how to tell whether a cloud is the one that is meant."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from glsk_o3d.errors import InvalidParameterError, did_you_mean
from glsk_o3d.interop.atomic import write_atomically

SUM_UNIT = 1e-8  # derived: a tenth of what all roundings together can make of a sum
# derived: twice what they make, of 3 coordinates a point, below 1 and rounded to 2^-24, with weights of 1/2 in the mean
SUM_TOLERANCE = 2 * 3 * 2.0**-24 / 2
HASH_FACTORS = (0x85EBCA6B, 0xC2B2AE35)  # published: of MurmurHash3's finalizer (Appleby 2008)


@dataclass(frozen=True)
class Version:
    """What a version of the benchmark is made of: all its clouds, and which of them are scored."""

    name: str
    families: tuple[str, ...]
    seeds: tuple[int, ...]  # of the shapes of each family
    variants: tuple[str, ...]
    points: int  # of each cloud
    draw: int  # the seed of the clouds
    whole: tuple[str, ...]  # the variants that show the whole surface: their coverage is 1
    least_coverage: float  # clouds with less are not scored: nobody can be asked for what they do not show
    things: bool = False  # whether its shapes are things, of whose truth more is known
    left_out: tuple[str, ...] = ()  # clouds that cannot be made: scanners see too little of the shape
    steady: bool = False  # whether normals on edges of animals do not depend on roundings

    def variants_of(self, shape: str) -> tuple[str, ...]:
        """The variants that there are of a shape."""
        return tuple(each for each in self.variants if f"{shape}_{each}" not in self.left_out)


_V1 = Version(
    "v1",
    families=("tubes", "trees", "frames", "figures", "handles", "groups"),
    seeds=tuple(range(100, 112)),
    variants=(
        *("clean", "density", "holes", "outliers", "noise05", "noise1", "noise2"),
        *("scan2", "depth2", "misreg", "lidar"),
    ),
    points=4096,
    draw=0,
    whole=("clean", "outliers", "noise05", "noise1", "noise2"),
    least_coverage=0.97,
)
_V2 = replace(
    _V1,
    name="v2",
    families=("prisms", "implements", "animals", "plates", "blades", "mugs"),
    things=True,
    left_out=("plates_110_depth2",),
)
_V3 = replace(
    _V2,
    name="v3",
    families=(*_V2.families, "toys", "rings"),
    variants=(*_V2.variants, "flying"),
    steady=True,
)
VERSIONS = {each.name: each for each in (_V1, _V2, _V3)}
"""All versions by name. One that has been published is never changed."""
OWN = "own"
"""What stands for the version where clouds and axes are somebody's own."""


def version(name: str) -> Version:
    """The version of that name."""
    if name not in VERSIONS:
        raise InvalidParameterError(did_you_mean(name, VERSIONS, "version of the benchmark"))
    return VERSIONS[name]


def fingerprint(points: np.ndarray) -> str:
    """Eight digits of the SHA-256 of a cloud's bytes, and two sums of its coordinates with weights.

    Processors differ in the last bits of logarithms, and then the digits say nothing. The sums, over the number of
    points, say how far a cloud is from the one that is meant: all roundings together move them by less than
    `SUM_TOLERANCE`, one point in another place by more. Weights follow from the place in the file: points in another
    order are another cloud.
    """
    rows = np.ascontiguousarray(points, "<f4")
    digits = hashlib.sha256(rows.tobytes()).hexdigest()[:8]
    return " ".join([digits, *(str(round(each / SUM_UNIT)) for each in _sums(rows))])


def _sums(rows: np.ndarray) -> np.ndarray:
    """Two sums of all coordinates, each times a weight that follows from its place, over the number of points."""
    mixed = np.arange(1, 2 * rows.size + 1, dtype=np.uint64)
    for shift, factor in zip((16, 13), HASH_FACTORS, strict=True):  # whole numbers: the same weights on all processors
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor) % np.uint64(2**32)
    weights = (mixed ^ (mixed >> np.uint64(16))).astype(float).reshape(2, -1) / 2**31 - 1
    return weights @ rows.ravel().astype(float) / max(len(rows), 1)


def sameness(points: np.ndarray, known: str) -> str:
    """Whether a cloud is the one of a fingerprint: to the last ``bits``, but for ``rounding``, or an ``other``."""
    found, known_words = fingerprint(points).split(), known.split()
    if found == known_words:
        return "bits"
    apart = np.subtract(np.array(found[1:], float), np.array(known_words[1:], float)) * SUM_UNIT
    return "rounding" if (np.abs(apart) <= SUM_TOLERANCE).all() else "other"


def fingerprints(name: str) -> dict[str, str]:
    """The fingerprints of all clouds of a version, by their names; empty where the package has none."""
    shapes = _known(name)["clouds"]
    return {f"{shape}_{variant}": words for shape, clouds in shapes.items() for variant, words in clouds.items()}


def is_scored(asked: Version, cloud: str, coverage: float) -> bool:
    """Whether answers to a cloud count: fixed with the version, so that roundings of the coverage do not decide."""
    if cloud in fingerprints(asked.name):
        return cloud not in _known(asked.name)["unscored"]
    return coverage >= asked.least_coverage


def write_fingerprints(name: str, found: dict[str, dict[str, str]], unscored: Iterable[str]) -> Path:
    """Write the fingerprints of a version into the package. For whoever makes a version, once."""
    clouds = ",\n".join(f"  {json.dumps(shape)}: {json.dumps(words)}" for shape, words in sorted(found.items()))
    text = f'{{\n "unscored": {json.dumps(sorted(unscored))},\n "clouds": {{\n{clouds}\n }}\n}}\n'
    write_atomically(_file(name), lambda temporary: temporary.write_text(text, encoding="utf-8"))
    return _file(name)


def _known(name: str) -> dict[str, Any]:
    path = _file(name)
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"clouds": {}, "unscored": []}


def _file(name: str) -> Path:
    return Path(__file__).with_name(f"fingerprints_{name}.json")
