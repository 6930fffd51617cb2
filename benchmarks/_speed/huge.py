"""Clouds larger than memory, from disk to disk: what they cost, and whether their skeleton is that of a small one."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from _common.tables import Tables, number, short

from glsk_o3d import Skeleton, read_cloud, read_skeleton, skeletonize
from glsk_o3d.interop.packages import require
from glsk_o3d.io.formats import ply
from glsk_o3d.samples import sauropod

from .large import apart, from_file_to_file
from .timing import fresh_python

HUGE_BLOCK = 1_000_000  # points written at a time
SURFACE_POINTS = 2_000_000  # of which each is drawn again and again, with noise of its own: far nearer than the noise
HUGE_NOISE = 0.003  # its standard deviation, as a share of the diagonal
GB = 1e9
LAS_STEP = 1e-5  # between coordinates in LAS, in units of the shape, which is one and a half long

LABELS = """
import json, resource, sys
told, benchmarks, skeleton, cloud, labelled = sys.argv[1:]
sys.path.insert(0, benchmarks)
from _speed.stopwatch import MB, peak
from glsk_o3d import annotate_file, read_skeleton
annotate_file(read_skeleton(skeleton), cloud, labelled)
used = resource.getrusage(resource.RUSAGE_SELF)
with open(told, "w") as file:
    json.dump(dict(file_cpu=used.ru_utime + used.ru_stime, file_peak=peak() / MB), file)
"""
"""Labels from file to file, imports and all, and what it took."""


def noisy_blocks(n: int, seed: int = 0) -> Iterator[np.ndarray]:
    """The sauropod, whole and noisy, as (m, 3) float arrays in random order."""
    draw = np.random.default_rng(seed)
    surface = draw.permutation(sauropod(min(n, SURFACE_POINTS), cameras=None, seed=seed).points)
    sigma = HUGE_NOISE * np.linalg.norm(np.ptp(surface, axis=0))
    for begin in range(0, n, HUGE_BLOCK):
        rows = np.arange(begin, min(n, begin + HUGE_BLOCK)) % len(surface)
        yield surface[rows] + draw.normal(scale=sigma, size=(len(rows), 3))


def write_huge(path: Path, n: int, seed: int = 0) -> None:
    """Such a cloud as binary PLY of float32, or as LAS or LAZ."""
    blocks = noisy_blocks(n, seed)
    if path.suffix == ".ply":
        with path.open("wb") as stream:
            stream.write(ply.header_of(np.dtype([(axis, "<f4") for axis in "xyz"]), n))
            for block in blocks:
                stream.write(block.astype("<f4").tobytes())
        return
    laspy = require("laspy")
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [LAS_STEP] * 3
    with laspy.open(path, mode="w", header=header) as file:
        for block in blocks:
            record = laspy.ScaleAwarePointRecord.zeros(len(block), header=header)
            record.x, record.y, record.z = block.T
            file.write_points(record)


def measure_huge(endings: list[str], labelled: list[str], n: int, against: int, folder: Path | None) -> list[dict]:
    """A row for the whole command on each file, and how far its skeleton is from that of a small cloud of the shape;
    and one for labels of all points.

    In a folder of one's own files stay, and those that are there already are taken.
    """
    with tempfile.TemporaryDirectory() as scratch:
        small = Path(scratch, "small.ply")
        write_huge(small, against, seed=1)
        base = skeletonize(read_cloud(small))
        diagonal = float(np.linalg.norm(np.ptp(base.points, axis=0)))
        rows = [dict(measure="huge", file=f"in memory, from {small.suffix}", n=against, **shape(base))]
        for ending in endings:
            path = Path(folder or scratch, f"huge_{n}{ending}")
            if not path.exists():
                write_huge(path, n)
            size, skeleton = path.stat().st_size / GB, path.with_suffix(".npz")
            facts = from_file_to_file(path, "--stream", "-o", skeleton)
            found = read_skeleton(skeleton)
            mean, most = apart(found, base, diagonal)
            row = dict(measure="huge", n=n)
            rows.append(row | dict(file=ending, size=size, mean=mean, most=most) | facts | shape(found))
            if ending in labelled:
                rows.append(row | dict(file=f"{ending}: labels") | label(path, skeleton))
            if folder is None:
                path.unlink()
        return rows


def label(cloud: Path, skeleton: Path) -> dict[str, float]:
    """CPU and wall seconds of `annotate_file`, the most memory in MB of the process, and the size of what it writes."""
    told, labelled = cloud.with_name("told.json"), cloud.with_name("labelled.ply")
    _, wall = fresh_python(LABELS, told, Path(__file__).parents[1], skeleton, cloud, labelled)
    size = labelled.stat().st_size / GB
    labelled.unlink()
    return json.loads(told.read_text()) | dict(file_wall=wall, size=size)


def shape(skeleton: Skeleton) -> dict[str, int]:
    """How a skeleton hangs together."""
    ends = int((skeleton.degree == 1).sum())
    return dict(vertices=len(skeleton.vertices), components=skeleton.n_components, loops=skeleton.n_loops, ends=ends)


def huge_tables(rows: list[dict]) -> Tables:
    """A line for each file."""
    header = ["", "points", "file GB", "CPU s", "wall s", "MB", "vertices", "components", "loops", "ends"]
    lines = []
    for row in rows:
        spent = [short(row[key]) if key in row else "-" for key in ("file_cpu", "file_wall")]
        size, peak = number(row.get("size"), 2), number(row.get("file_peak"), 0)
        counts = [str(row.get(key, "-")) for key in ("vertices", "components", "loops", "ends")]
        away = [number(row.get(key), 2) for key in ("mean", "most")]
        lines.append([row["file"], str(row["n"]), size, *spent, peak, *counts, *away])
    return [("from disk to disk", [*header, "mean %", "largest %"], lines)]
