"""Large clouds: what they cost, and how far their skeletons are from that of the smallest size."""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path

import numpy as np
from _common.clouds import builtin, cases
from _common.runs import run
from _common.tables import Tables, number, short

from glsk_o3d import Skeleton, read_skeleton
from glsk_o3d.analysis.curves import distances
from glsk_o3d.interop.packages import import_open3d
from glsk_o3d.pipelines import default

from .stages import told
from .stopwatch import MB, peak, reset_peak, resident
from .timing import fresh_python

STEP = 0.001  # between the places of a curve at which `large` measures it, as a share of the diagonal


COMMAND = """
import json, resource, sys
told, benchmarks, *words = sys.argv[1:]
sys.path.insert(0, benchmarks)
from _speed.stopwatch import MB, peak
from glsk_o3d.cli.main import app
app(words, standalone_mode=False)
used = resource.getrusage(resource.RUSAGE_SELF)
with open(told, "w") as file:
    json.dump(dict(file_cpu=used.ru_utime + used.ru_stime, file_peak=peak() / MB), file)
"""
"""The whole command ``glsk``, imports and all, and what it took."""


def from_file_to_file(cloud: Path, *more: str | Path) -> dict[str, float]:
    """CPU and wall seconds of ``glsk skeletonize``, and the most memory in MB, all of the process."""
    told, skeleton = cloud.with_name("told.json"), cloud.with_name("skeleton.ply")
    _, wall = fresh_python(COMMAND, told, Path(__file__).parents[1], "skeletonize", cloud, "-o", skeleton, *more)
    return json.loads(told.read_text()) | dict(file_wall=wall)


def once(path: Path, file: bool) -> dict:
    """One run of `default` on a saved cloud, to be made in a fresh process; its curve is saved beside the cloud."""
    reset_peak()
    before = resident()
    points = np.load(path)
    start = time.process_time(), time.perf_counter()
    skeleton = default()(points)
    spent = dict(cpu=time.process_time() - start[0], wall=time.perf_counter() - start[1])
    facts = spent | dict(peak=(peak() - before) / MB, sampled=skeleton.report.n_sampled) | told(skeleton)
    facts["diagonal"] = float(np.linalg.norm(np.ptp(points, axis=0)))
    curve = Skeleton(skeleton.vertices, skeleton.edges, skeleton.radii, (), (), ())
    curve.save(path.with_suffix(".json"))
    return facts | (from_file_to_file(path.with_suffix(".ply")) if file else {})


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
                save_cloud(path, builtin(shape, f"clean_{n}")[0], file)
            work = [(dict(measure="large", n=n, shape=shape), (path, file)) for n, path in paths.items()]
            here = run(once, work, min(jobs, 1), fresh=True)
            base = here[0]
            for row in here[1:]:
                if "failure" not in row and "failure" not in base:
                    curve, other = (read_skeleton(paths[it["n"]].with_suffix(".json")) for it in (row, base))
                    mean, most = apart(curve, other, base["diagonal"])
                    row |= dict(base=base["n"], mean=mean, most=most, same_loops=row["loops"] == base["loops"])
        rows += here
    return rows


def save_cloud(path: Path, points: np.ndarray, file: bool) -> None:
    """As an array, and where asked for as PLY beside it."""
    np.save(path, points)
    if file:
        o3d = import_open3d()
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        if not o3d.io.write_point_cloud(str(path.with_suffix(".ply")), cloud):
            raise OSError(f"{path.with_suffix('.ply')} could not be written: is the disk full?")


def large_tables(rows: list[dict]) -> Tables:
    """A line for each shape and size."""
    files = any("file_cpu" in row for row in rows)
    header = ["", "points", "CPU s", "MB", "sampled", "contracted", "vertices", "mean %", "largest %", "loops", "same"]
    header += ["file CPU s", "file wall s", "file MB"] if files else []
    lines = []
    for row in rows:
        if "failure" in row:
            lines.append([row["shape"], str(row["n"]), *"-" * (len(header) - 2), row["failure"]])
            continue
        counts = [str(row[key]) for key in ("sampled", "contracted", "vertices")]
        away = [number(row.get(key), 2) for key in ("mean", "most")]
        same = {True: "yes", False: "no", None: "-"}[row.get("same_loops")]
        cells = [short(row["cpu"]), number(row["peak"], 0), *counts, *away, str(row["loops"]), same]
        if files:
            cells += [short(row["file_cpu"]), short(row["file_wall"]), number(row["file_peak"], 0)]
        lines.append([row["shape"], str(row["n"]), *cells, ""])
    return [(f"default, against {min(row['n'] for row in rows)} points", [*header, "note"], lines)]
