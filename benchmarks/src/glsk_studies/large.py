"""Clouds that are large, or larger than memory: what they cost, and how far their skeletons are from a small one's."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from glsk_o3d import Skeleton, read_cloud, read_skeleton, save_skeleton, skeletonize
from glsk_o3d.analysis.curves import distances
from glsk_o3d.interop.packages import require
from glsk_o3d.io.formats import ply
from glsk_o3d.pipelines import default
from glsk_o3d.samples import sauropod

from .clouds import builtin, cases
from .runs import run
from .stages import counts_of
from .stopwatch import fresh_python, once
from .tables import Tables, brief, fixed, table

STEP = 0.001  # between the places of a curve at which `large` measures it, as a share of the diagonal
HUGE_BLOCK = 1_000_000  # points written at a time
SURFACE_POINTS = 2_000_000  # of which each is drawn again and again, with noise of its own: far nearer than the noise
HUGE_NOISE = 0.003  # its standard deviation, as a share of the diagonal
GB = 1e9
LAS_STEP = 1e-5  # between coordinates in LAS, in units of the shape, which is one and a half long
MEASURED = """
import json, resource, sys
told, *words = sys.argv[1:]
from glsk_studies.stopwatch import MB, peak
{work}
used = resource.getrusage(resource.RUSAGE_SELF)
with open(told, "w") as file:
    json.dump(dict(file_cpu=used.ru_utime + used.ru_stime, file_peak=peak() / MB), file)
"""
"""Work from file to file, imports and all, and what it took."""
COMMAND = "from glsk_o3d.cli.main import app; app(words, standalone_mode=False)"
LABELS = "from glsk_o3d import annotate_file, read_skeleton; annotate_file(read_skeleton(words[0]), *words[1:])"


def spent(work: str, cloud: Path, *words: str | Path) -> dict[str, float]:
    """CPU and wall seconds of work in a process of its own, and the most memory in MB, imports included."""
    told = cloud.with_name("told.json")
    _, wall = fresh_python(MEASURED.format(work=work), told, *words)
    return json.loads(told.read_text()) | dict(file_wall=wall)


def measure(path: Path, file: bool) -> dict:
    """One run of `default` on a saved cloud, to be made in a fresh process; its curve is saved beside the cloud."""
    points = np.load(path)
    skeleton, costs = once(default(), points)
    facts = costs | dict(sampled=skeleton.report.n_sampled) | counts_of(skeleton)
    facts["diagonal"] = float(np.linalg.norm(np.ptp(points, axis=0)))
    curve = Skeleton(skeleton.vertices, skeleton.edges, skeleton.radii, (), (), ())
    save_skeleton(curve, path.with_suffix(".json"))
    cloud = path.with_suffix(".ply")
    return facts | (spent(COMMAND, cloud, "skeletonize", cloud, "-o", path.with_suffix(".out.ply")) if file else {})


def apart(curve: Skeleton, other: Skeleton, diagonal: float) -> tuple[float, float]:
    """Mean, over both ways, and largest distance of two curves, in percent of the diagonal."""
    ways = [distances(*pair, STEP * diagonal)[0] for pair in ((curve, other), (other, curve))]
    mean, most = np.mean([way.mean() for way in ways]), max(way.max() for way in ways)
    return float(100 * mean / diagonal), float(100 * most / diagonal)


def measure_large(sizes: list[int], shapes: str, file: bool, jobs: int) -> list[dict]:
    """A row for each shape and size, and how far its skeleton is from that of the smallest size."""
    sizes, rows = sorted(sizes), []
    found = cases(None, True, ",".join(f"clean_{n}" for n in sizes), shapes)
    for shape in dict.fromkeys(case.shape for case in found):
        with tempfile.TemporaryDirectory() as folder:
            paths = {n: Path(folder, f"{n}.npy") for n in sizes}
            for n, path in paths.items():
                points = builtin(shape, f"clean_{n}")[0]
                np.save(path, points)
                if file:
                    ply.save(path.with_suffix(".ply"), {"positions": points})
            work = [(dict(measure="large", n=n, shape=shape), (path, file)) for n, path in paths.items()]
            here = run(measure, work, min(jobs, 1), fresh=True)
            base = here[0]
            for row in here[1:]:
                if "failure" not in row and "failure" not in base:
                    curve, other = (read_skeleton(paths[it["n"]].with_suffix(".json")) for it in (row, base))
                    mean, most = apart(curve, other, base["diagonal"])
                    row |= dict(base=base["n"], mean=mean, most=most, same_loops=row["loops"] == base["loops"])
        rows += here
    return rows


def large_tables(rows: list[dict]) -> Tables:
    """A line for each shape and size."""
    columns = {"": "shape", "points": "n", "CPU s": brief("cpu"), "MB": fixed("peak", 0)}
    columns |= {name: name for name in ("sampled", "contracted", "vertices")}
    columns |= {"mean %": fixed("mean"), "largest %": fixed("most"), "loops": "loops"}
    columns |= {"same": lambda row: "yes" if row["same_loops"] else "no"}
    if any("file_cpu" in row for row in rows):
        columns |= {"file CPU s": brief("file_cpu"), "file wall s": brief("file_wall")}
        columns |= {"file MB": fixed("file_peak", 0)}
    return [table(f"default, against {min(row['n'] for row in rows)} points", rows, columns)]


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
            facts = spent(COMMAND, path, "skeletonize", path, "-o", skeleton)
            found = read_skeleton(skeleton)
            mean, most = apart(found, base, diagonal)
            row = dict(measure="huge", n=n)
            rows.append(row | dict(file=ending, size=size, mean=mean, most=most) | facts | shape(found))
            if ending in labelled:
                out = path.with_name("labelled.ply")
                facts = spent(LABELS, path, skeleton, path, out)
                rows.append(row | dict(file=f"{ending}: labels", size=out.stat().st_size / GB) | facts)
                out.unlink()
            if folder is None:
                path.unlink()
        return rows


def shape(skeleton: Skeleton) -> dict[str, int]:
    """How a skeleton hangs together."""
    ends = int((skeleton.degree == 1).sum())
    return dict(vertices=len(skeleton.vertices), components=skeleton.n_components, loops=skeleton.n_loops, ends=ends)


def huge_tables(rows: list[dict]) -> Tables:
    """A line for each file."""
    columns = {"": "file", "points": "n", "file GB": fixed("size"), "CPU s": brief("file_cpu")}
    columns |= {"wall s": brief("file_wall"), "MB": fixed("file_peak", 0)}
    columns |= {name: name for name in ("vertices", "components", "loops", "ends")}
    columns |= {"mean %": fixed("mean"), "largest %": fixed("most")}
    return [table("from disk to disk", rows, columns, note=False)]
