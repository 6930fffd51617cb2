"""The folder of a benchmark: clouds, true axes, and ``benchmark.json``, which says what there is."""

from __future__ import annotations

import json
import os
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from glsk_o3d.analysis.comparison import Truth
from glsk_o3d.errors import FileFormatError, InvalidParameterError
from glsk_o3d.interop.atomic import write_atomically, write_json
from glsk_o3d.io.formats import ply

from .truths import THING_ARRAYS, read_axis
from .versions import OWN, VERSIONS

INDEX_NAME = "benchmark.json"
_EXPLAINED = {
    "clouds/SHAPE_VARIANT.ply": "a cloud: binary PLY, little-endian, float x, y, z; the shape's box has the diagonal 1",
    "truth/SHAPE.npz": "its true axis, an archive of NumPy's: nodes (V, 3), edges (E, 2), radii (V,)",
    "scored": "whether answers to this cloud count: it shows enough of the shape",
    "coverage": "the share of the axis that the cloud shows",
    "sameness": "to the cloud that is meant: bits, rounding or other; null where the package knows none",
}
_EXPLAINED_OF_THINGS = _EXPLAINED | {
    "truth/SHAPE.npz": _EXPLAINED["truth/SHAPE.npz"]
    + ", half_width (V,); flat (k,), nodes at flat ends; judged (E,); mirror (2, 3), a point and a normal, or (0, 3)",
    "not_made": "clouds that cannot be made, and why",
}
_EXPLAINED_OF_OWN = {
    "clouds/SHAPE_VARIANT.ply": "a cloud: binary PLY, little-endian, float or double x, y, z, in units of its own",
    "truth/SHAPE.npz": _EXPLAINED["truth/SHAPE.npz"],
    "radii": "given with the axis, or the variant of the cloud in which they were measured",
}


@dataclass(frozen=True)
class CloudFile:
    """A cloud of a benchmark."""

    shape: str
    variant: str
    family: str
    path: Path
    scored: bool

    @property
    def name(self) -> str:
        """What an answer to it is called, before the ending."""
        return f"{self.shape}_{self.variant}"


@dataclass(frozen=True)
class BenchmarkFolder:
    """A folder that `make` or `add_shape` has written, or is writing.

    Attributes
    ----------
    path : Path
    version : str
        "own" for clouds of your own.
    shapes : dict of str to dict
        The entries of ``benchmark.json``: family, seed, truth, facts, and clouds by variant.
    complete : bool
        Whether all requested clouds are made.

    Examples
    --------
    >>> BenchmarkFolder(Path("empty"), "v1").clouds
    []
    """

    path: Path
    version: str
    shapes: dict[str, dict[str, Any]] = field(default_factory=dict)
    complete: bool = False

    @property
    def clouds(self) -> list[CloudFile]:
        """All clouds, by shape and then in the order of the variants: of one's own clouds, as they were added."""
        found = []
        for shape, told in sorted(self.shapes.items()):
            names = [*told["clouds"]]
            for variant in names if self.version == OWN else sorted(names, key=VERSIONS[self.version].variants.index):
                cloud = told["clouds"][variant]
                place = self.path / cloud["file"]
                found.append(CloudFile(shape, variant, told["family"], place, bool(cloud["scored"])))
        return found

    def digits(self, cloud: CloudFile) -> str | None:
        """Digits that identify one of your own clouds; None for those of a version, which their names identify."""
        shape = self.shapes[cloud.shape]
        if self.version != OWN:
            return None
        return f"{shape['fingerprint']} {shape['clouds'][cloud.variant]['fingerprint']}"

    @property
    def scored(self) -> list[CloudFile]:
        """The scored clouds."""
        return [cloud for cloud in self.clouds if cloud.scored]

    @property
    def whole(self) -> bool:
        """Whether these are all shapes and variants of the version, and no others."""
        if self.version == OWN:
            return False
        asked = VERSIONS[self.version]
        names = {f"{family}_{seed}" for family in asked.families for seed in asked.seeds}
        return names == self.shapes.keys() and all(
            set(asked.variants_of(name)) == told["clouds"].keys() for name, told in self.shapes.items()
        )

    @property
    def name(self) -> str:
        """What it is called where scores are compared: its version, and of one's own clouds and axes eight digits that
        differ where these do.
        """
        if self.version != OWN:
            return self.version
        prints = [[name, self.shapes[name]["fingerprint"]] for name in sorted(self.shapes)]
        prints += [[each.name, self.shapes[each.shape]["clouds"][each.variant]["fingerprint"]] for each in self.clouds]
        return f"{OWN} {zlib.crc32(json.dumps(sorted(prints)).encode()):08x}"

    def truth(self, shape: str) -> Truth:
        """The true axis of a shape.

        Parameters
        ----------
        shape : str

        Returns
        -------
        Truth
            Of a thing, a `ThingTruth`, which also has `half_width`, `flat`, `judged` and `mirror`.

        Raises
        ------
        FileNotFoundError
        FileFormatError
            The file holds no axis.
        """
        return read_axis(self.path / self.shapes[shape]["truth"])

    def save(self) -> None:
        """Write ``benchmark.json``."""
        asked = VERSIONS.get(self.version)
        choice = asked and {"points": asked.points, "draw": asked.draw, "least_coverage": asked.least_coverage}
        explained = _EXPLAINED_OF_OWN
        if asked:
            explained = _EXPLAINED_OF_THINGS if asked.things else _EXPLAINED
        told = {
            "benchmark": "curve skeletons of point clouds",
            **{"version": self.version, "complete": self.complete, "whole": self.whole},
            **(choice or {}),
            "explained": explained,
            "shapes": dict(sorted(self.shapes.items())),
        }
        write_json(self.path / INDEX_NAME, told)


def read_folder(path: str | os.PathLike) -> BenchmarkFolder:
    """The benchmark in a folder.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    BenchmarkFolder

    Raises
    ------
    FileNotFoundError
        There is no ``benchmark.json``.
    FileFormatError
        It is damaged, or of a version that this package does not know.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     BenchmarkFolder(Path(folder), "v1").save()
    ...     read_folder(folder).shapes
    {}
    """
    index = Path(path) / INDEX_NAME
    if not index.is_file():
        raise FileNotFoundError(f"{index}: no such file: make a benchmark with 'glsk benchmark make {path}' first")
    try:
        told = json.loads(index.read_text(encoding="utf-8"))
        name = told["version"]
        if name not in (*VERSIONS, OWN):
            raise FileFormatError(f"{index}: is of version {name!r}: this package knows {', '.join([*VERSIONS, OWN])}")
        found = BenchmarkFolder(Path(path), name, told["shapes"], bool(told["complete"]))
        _check(found)
    except FileFormatError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise FileFormatError(f"{index}: is damaged ({type(error).__name__}: {error}): make it anew") from None
    return found


def _check(folder: BenchmarkFolder) -> None:
    """Raise ValueError for names that lead out of the folder or that two clouds have; KeyError and the like for what is
    not there at all.
    """
    names = [cloud.name for cloud in folder.clouds]
    if len(set(names)) < len(names) or not folder.name:  # which takes all fingerprints of one's own
        raise ValueError("two clouds have one name")
    for cloud in folder.clouds:
        truth = folder.shapes[cloud.shape]["truth"]
        for name in (cloud.path.relative_to(folder.path).as_posix(), truth):
            place, _, last = name.partition("/")
            if place not in ("clouds", "truth") or not last or "/" in last or "\\" in last:
                raise ValueError(f"{name!r} is no file of a benchmark")
        if cloud.name != Path(cloud.name).name:
            raise ValueError(f"{cloud.name!r} is no name of a cloud")


def begun(path: Path, version: str) -> BenchmarkFolder:
    """The folder as it is, made if it is not there; InvalidParameterError if it has another version."""
    for place in ("clouds", "truth"):
        (path / place).mkdir(parents=True, exist_ok=True)
    if not (path / INDEX_NAME).exists():
        return BenchmarkFolder(path, version)
    found = read_folder(path)
    if found.version != version:
        has = "clouds of somebody's own" if found.version == OWN else f"version {found.version}"
        raise InvalidParameterError(f"{path}: has {has}, not {version}: give another folder")
    return found


def write_axis(path: Path, axis: Any) -> None:
    """Write the `nodes`, `edges` and `radii` of anything that has them; and of a thing, what else is known."""
    parts = {"nodes": axis.nodes, "edges": axis.edges, "radii": axis.radii}
    parts |= {name: getattr(axis, name) for name in THING_ARRAYS if hasattr(axis, name)}
    write_atomically(path, lambda temporary: np.savez(temporary, **parts))


def write_points(path: Path, points: np.ndarray) -> None:
    """Write a cloud, (n, 3) float32 or float64 array."""
    ply.save(path, {"positions": points})
