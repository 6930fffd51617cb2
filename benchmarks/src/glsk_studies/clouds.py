"""Clouds with known axes: the built-in ones, and those of a folder."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import filter as matching
from functools import lru_cache, partial
from itertools import chain, product
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
import open3d as o3d
import typer
from glsk_bench import read_folder
from glsk_bench.folders import INDEX_NAME
from scipy.spatial import cKDTree

from glsk_o3d import read_cloud, read_truth, samples
from glsk_o3d.analysis import Truth
from glsk_o3d.interop.clouds import cloud_points
from glsk_o3d.samples.capsules import union_sample

from .tables import ROOT

HOLES = 6  # in a built-in cloud with holes, each of them as far across as the part it is in
SHOWN = 0.97  # least share of the true axis that a cloud must show for its skeleton to be scored


def _uneven_y(n: int, *, noise: float, seed: int) -> samples.Sample:
    """A stem and two arms 130 degrees apart, each of another radius."""
    sine, cosine = np.sin(np.deg2rad(65)), np.cos(np.deg2rad(65))
    nodes = 0.5 * np.array([[0, 0, 0], [0, 0, -1], [-sine, 0, cosine], [sine, 0, cosine]])
    edges, radii = np.array([[0, 1], [0, 2], [0, 3]]), np.array([0.12, 0.12, 0.06, 0.04])
    return union_sample("uneven_y", nodes, edges, radii, n, noise, seed)


BUILTIN: dict[str, Callable[..., samples.Sample]] = {
    "tube": samples.tube,
    "thin_tube": partial(samples.tube, radius=0.04),
    "y_junction": samples.y_junction,
    "uneven_y": _uneven_y,
    "torus": samples.torus,
    "thin_torus": partial(samples.torus, radius=0.05),
    "two_rings": samples.two_rings,
    "helix": samples.helix,
    "sauropod": partial(samples.sauropod, cameras=None),
}
"""Samples of the package that have an axis, as whole surfaces."""
BUILTIN_VARIANT = re.compile(r"(clean|density|holes|outliers|scan(?=2_)|noise(?=\d))(\d*|\d+\.\d+)_(\d+)")
CAMERAS = np.array([[1, -2, 2], [-1, 2, 2]]) / 3  # where from a built-in scan is taken; nothing is hidden from both


@dataclass(frozen=True)
class Case:
    """A cloud with a known axis: a shape of a folder, or a built-in one (no folder), in some state of disrepair.

    Of several clouds of one shape and variant each is another `draw`.
    """

    shape: str
    variant: str
    folder: Path | None = None
    draw: int = 0

    @property
    def size(self) -> int:
        """Points, as its variant says; those of a public benchmark are counted."""
        told = self.variant.rpartition("_")[2]
        return int(told) if told.isdecimal() else len(self.load()[0])

    @property
    def facts(self) -> dict[str, str | int | None]:
        """What a row says of it. A shape whose name is not FAMILY_SEED has no seed, and its folder for a family."""
        random = re.fullmatch(r"(.+)_(\d+)", self.shape)
        place = "built-in" if self.folder is None else self.folder.resolve().name
        family, seed = (random[1], int(random[2])) if random else (place, None)
        return dict(variant=self.variant, shape=self.shape, family=family, seed=seed, draw=self.draw)

    def load(self) -> tuple[np.ndarray, Truth]:
        """The points and the axis."""
        if self.folder is None:
            return builtin(self.shape, self.variant, self.draw)
        if (self.folder / INDEX_NAME).is_file():
            made = _benchmark(self.folder)
            path = made.path / made.shapes[self.shape]["clouds"][self.variant]["file"]
            return cloud_points(read_cloud(path)), made.truth(self.shape)
        path = self.folder / f"{self.shape}.npz"
        with np.load(path) as archive:
            return archive[self.variant].astype(float), read_truth(path)


def builtin(shape: str, variant: str, draw: int = 0) -> tuple[np.ndarray, Truth]:
    """A built-in shape as KIND_SIZE: clean, density, holes, outliers, scan2, or noise with its percentage."""
    found = BUILTIN_VARIANT.fullmatch(variant)
    if found is None:
        raise ValueError(
            f"{variant}: built-in variants are clean_N, density_N, holes_N, outliers_N, scan2_N and noiseP_N"
        )
    kind, percent, n = found[1], float(found[2] or 0), int(found[3])
    rng = np.random.default_rng(1 + draw)
    # the points of a sample are independent, so that the first n of those kept are a fair choice
    more, noise = 10 if kind in ("density", "holes", "scan") else 1, percent / 100 if kind == "noise" else 0.0
    drawn = BUILTIN[shape](more * n, noise=noise, seed=draw)
    points, kept = drawn.points, np.ones(len(drawn.points), bool)
    if kind == "density":  # ten times as dense at one end as at the other
        along = points[:, np.ptp(points, axis=0).argmax()]
        kept = rng.random(len(points)) < 10 ** ((along - along.min()) / np.ptp(along) - 1)
    elif kind == "holes":
        centres = points[rng.choice(len(points), HOLES)]
        widths = drawn.radii[cKDTree(drawn.nodes).query(centres)[1]]
        kept = (np.linalg.norm(points[:, None] - centres, axis=2) > widths).all(axis=1)
    elif kind == "scan":
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        size, kept = np.linalg.norm(np.ptp(points, axis=0)), np.zeros(len(points), bool)
        for camera in cloud.get_axis_aligned_bounding_box().get_center() + 2 * size * CAMERAS:
            kept[cloud.hidden_point_removal(camera, 1000 * size)[1]] = True
    elif kind == "outliers":
        points = points.copy()
        points[: n // 100] = rng.uniform(points.min(axis=0), points.max(axis=0), (n // 100, 3))
    return points[kept][:n], Truth(drawn.nodes, drawn.edges, drawn.radii)


def cases(
    folders: Path | Sequence[Path] | None, own: bool, variants: str, shapes: str = "", draws: int = 1
) -> list[Case]:
    """What a command is to run on; what there is not, or the manifest says not to score, is left out, and said so.

    Of folders, else of $GLSK_TRUTH, else of shared/truth beside the repository, or the `own` shapes. A cloud that
    several folders have is drawn as often; of built-in ones there are so many draws. Variants are names with commas, or
    patterns such as ``*_4096`` of what the folders have; shapes are names with commas, a number for so many, or empty.
    """
    asked = variants.split(",")
    offers: dict[Path | None, dict[str, list[str]]]
    if own:
        makable = [name for name in asked if BUILTIN_VARIANT.fullmatch(name)]
        offers = {None: dict.fromkeys(BUILTIN, makable)}
    else:
        places = [folders] if isinstance(folders, Path) else folders or [None]
        offers = {place: _offers(place) for place in (folder_or(it, "GLSK_TRUTH", "shared/truth") for it in places)}
    names = _chosen(list(dict.fromkeys(chain.from_iterable(offers.values()))), shapes)
    known = dict.fromkeys(it for offer in offers.values() for held in offer.values() for it in held)
    wanted = dict.fromkeys(chain.from_iterable(matching([*known], name) or [name] for name in asked))
    found: list[Case] = []
    missing: Counter[str] = Counter()
    for variant, name in product(wanted, names):
        having = [place for place, offer in offers.items() if variant in offer.get(name, ())]
        found += [Case(name, variant, place, draw) for draw, place in enumerate(having * (draws if own else 1))]
        missing[variant] += not having
    if not found:
        raise typer.BadParameter(f"no such variants: {variants}")
    for variant, count in (+missing).items():
        typer.echo(f"left out: {variant} of {count} shapes", err=True)
    return found


def _chosen(known: list[str], shapes: str) -> list[str]:
    """The names of `known` that are asked for, or so many of them, evenly spread."""
    names = shapes.split(",") if shapes else known
    if shapes.isdecimal():
        names = [known[i] for i in np.linspace(0, len(known) - 1, min(int(shapes), len(known))).round().astype(int)]
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        raise typer.BadParameter(f"no shape {', '.join(unknown)}: there are {', '.join(known) or 'none'}")
    return names


def folder_or(folder: Path | None, variable: str, beside: str) -> Path:
    """The folder if given, else that of an environment variable, else the one beside the repository."""
    folder = folder or Path(os.environ.get(variable, ROOT.parent / beside))
    if not folder.is_dir():
        raise typer.BadParameter(f"there is no folder {folder}: name one, or set {variable}")
    return folder


def _offers(folder: Path) -> dict[str, list[str]]:
    """The variants to be scored of each shape with a meaningful skeleton."""
    if (folder / INDEX_NAME).is_file():  # a public benchmark
        offers: dict[str, list[str]] = {}
        for cloud in _benchmark(folder).scored:
            offers.setdefault(cloud.shape, []).append(cloud.variant)
        return offers
    manifest, coverage = folder / "manifest.json", {path.stem: {} for path in sorted(folder.glob("*.npz"))}
    if manifest.exists():
        shapes = json.loads(manifest.read_text())["shapes"]
        coverage = {it["name"]: it.get("coverage", {}) for it in shapes if it["meaningful_skeleton"]}
    return {name: _variants(folder / f"{name}.npz", shares) for name, shares in coverage.items()}


_benchmark = lru_cache(maxsize=4)(read_folder)  # once, and not for every cloud


def _variants(path: Path, coverage: dict[str, float]) -> list[str]:
    """The clouds of a file that show enough of the axis."""
    try:
        with np.load(path) as archive:
            names = [name for name in archive.files if name not in ("nodes", "edges", "radii")]
    except (OSError, ValueError, BadZipFile) as error:
        raise typer.BadParameter(f"{path} cannot be read: {error}") from None
    return [name for name in names if coverage.get(name, 1.0) >= SHOWN]
