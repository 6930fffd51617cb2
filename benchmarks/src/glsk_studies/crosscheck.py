"""What the cross-check says of clouds whose axis is known, of meshes, and of scans.

python benchmarks/crosscheck.py verdicts --builtin

The README of the benchmarks says what each command shows.
"""

from __future__ import annotations

import json
import time
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
import open3d as o3d
import typer
from glsk_bench.repeating import spread
from glsk_bench.scoring import score
from glsk_bench.truths import read_axis
from scipy.optimize import minimize

from glsk_o3d import read_cloud, skeletonize
from glsk_o3d.apps.crosscheck import cross_check
from glsk_o3d.apps.crosscheck.agreement import VERDICTS, WEIGHTS, of_counts, of_limbs

from .clouds import Case, cases
from .runs import Folders, Jobs, Markdown, Own, Shapes, Variants, application, run, study
from .tables import Tables, cells_of, good, grouped, number, present, read

STEPS = (0, 0.25, 0.5, 0.75, 0.9, 0.96, 1)  # of the reliability table
RIDGE = 0.05  # of the fit: what a weight costs
FITTED = ("constant", "solid", "limbs", "doubt")
MEDIANS = {
    "angle": lambda row: row["rows"]["angle"].get("median", np.nan),
    "eigenvalues": lambda row: row["rows"]["eigenvalue_ratio"],
    "apart": lambda row: row["skeletons"]["distance_in_radii"],
    "CPU ratio": lambda row: row["ratio"],
}
"""Medians in the table of verdicts: the last is the check's CPU seconds over those of the skeleton alone."""
AGREES, CANNOT_TELL = VERDICTS[0], VERDICTS[3]

app = application(__doc__)


def checked(cloud: Case | Path | tuple[Path, dict, bool]) -> dict:
    """The check of a cloud in numbers, and whether the graph is right if the true one is known."""
    if isinstance(cloud, Case):
        points, axis = cloud.load()
        axis = read_axis(cloud.folder / f"{cloud.shape}.npz") if cloud.folder else axis
    else:
        points = read_cloud(cloud) if isinstance(cloud, Path) else sampled(cloud[0], cloud[2])
    start = time.process_time()
    skeletonize(points)
    middle = time.process_time()
    check = cross_check(points)
    cpu = time.process_time() - middle
    row = check.to_dict() | dict(cpu=cpu, ratio=cpu / (middle - start))
    differs, limbs = of_counts(check.skeletons, check.solid), of_limbs(check.skeletons)
    facts = dict(solid=bool(differs), limbs=float(np.log1p(len(limbs))))
    row["facts"] = {name: fact * (not check.mesh.faults) for name, fact in facts.items()}
    if isinstance(cloud, Case):
        row["right"] = score(axis, check.skeleton.vertices, check.skeleton.edges).perfect
    elif not isinstance(cloud, Path):
        known = {name: cloud[1][name] for name in ("components", "loops", "ends") if name in cloud[1]}
        found = spread([check.skeleton], 1.0, **known)
        row["right"] = 0 not in (found["loops"], found["ends"])
    return row


def sampled(path: Path, poisson: bool) -> np.ndarray:
    """8192 points of a mesh by area, or 4096 evenly spaced ones."""
    mesh = o3d.io.read_triangle_mesh(str(path))
    o3d.utility.random.seed(1)
    return np.asarray((mesh.sample_points_poisson_disk(4096) if poisson else mesh.sample_points_uniformly(8192)).points)


def verdict_tables(rows: list[dict]) -> Tables:
    """Verdicts by family, what the promises come to, how the probability is to be taken, and what failed."""
    lines, found = [], good(rows)
    for name, here in [*grouped(rows, "family").items(), ("all", rows)]:
        for variant in dict.fromkeys(row["variant"] for row in here) if name != "all" else [""]:
            some = [row for row in good(here) if variant in ("", row["variant"])]
            count = Counter((row["verdict"], row["right"]) for row in some)
            cells = [f"{count[it, True]} / {count[it, True] + count[it, False]}" for it in VERDICTS]
            cells += [number(np.median([of(row) for row in some]), 2) if some else "-" for of in MEDIANS.values()]
            lines.append([f"{name} {variant}".removesuffix("_4096").strip(), *cells])
    noisy = np.array([row["variant"].startswith("noise") for row in found], bool)
    verdict, right = np.array([row["verdict"] for row in found]), np.array([row["right"] for row in found], bool)
    shares = {
        "of 'agrees' the graph is right": right[verdict == AGREES],
        "of wrong graphs 'agrees'": (verdict == AGREES)[~right],
        "of right graphs 'agrees'": (verdict == AGREES)[right],
        "of clean clouds 'cannot tell'": (verdict == CANNOT_TELL)[~noisy],
        "of noisy clouds 'cannot tell'": (verdict == CANNOT_TELL)[noisy],
    }
    promises = [[it, str(len(held)), number(100 * held.mean(), 1) if len(held) else "-"] for it, held in shares.items()]
    probability, steps = np.array([row["probability"] for row in found]), []
    for low, high in pairwise(STEPS):
        here = (low <= probability) & (probability < high) & (verdict != CANNOT_TELL)
        if here.any():
            means = [number(each[here].mean(), 2) for each in (probability, right)]
            steps.append([f"{low} to {high}", str(here.sum()), *means])
    failed = [[row["shape"], row["variant"], row["failure"]] for row in rows if "failure" in row]
    return [
        ("Right graphs / verdicts", ["clouds", *VERDICTS, *MEDIANS], lines),
        ("Shares", ["share", "clouds", "%"], promises),
        ("Probability", ["said", "clouds", "mean", "right"], steps),
        *([("Failures", ["shape", "variant", "note"], failed)] if failed else []),
    ]


@study(app, verdict_tables)
def verdicts(
    folders: Folders = None,
    own: Own = False,
    variant: Variants = "clean_4096,noise05_4096",
    shapes: Shapes = "",
    meshes: Annotated[Path | None, typer.Option(metavar="DIR", help="Also meshes with manifest.json.")] = None,
    jobs: Jobs = 2,
) -> list[dict]:
    """How often each verdict is given, and how often the graph is right then."""
    work: list[tuple[dict, tuple]] = []
    if own or folders or not meshes:
        work += [(case.facts, (case,)) for case in cases(folders, own, variant, shapes)]
    for known in json.loads((meshes / "manifest.json").read_text())["meshes"] if meshes else ():
        if known["loops"] is not None or known["ends"] is not None:
            for poisson, name in enumerate(("by area", "evenly spaced")):
                facts = dict(variant=name, shape=known["name"], family="meshes")
                work.append((facts, ((meshes / f"{known['name']}.ply", known, bool(poisson)),)))
    return run(checked, work, jobs)


@app.command()
def fit(
    files: Annotated[list[Path], typer.Argument(metavar="JSON...", exists=True)], markdown: Markdown = False
) -> None:
    """The weights of the probability, fitted to rows that `verdicts -o` has saved."""
    rows = [row for file in files for row in good(read(file)["rows"])]
    values = np.array([[1.0, row["facts"]["solid"], row["facts"]["limbs"], row["skeletons"]["doubt"]] for row in rows])
    right = np.array([row["right"] for row in rows])

    def loss(weights: np.ndarray) -> float:
        total = np.where(right, -1, 1) * (values @ weights)
        return float(np.logaddexp(0, total).sum() + RIDGE / 2 * (weights[1:] ** 2).sum())

    weights = minimize(loss, np.zeros(len(FITTED))).x
    lines = [[name, number(found, 2), number(WEIGHTS[name], 1)] for name, found in zip(FITTED, weights, strict=True)]
    present([(f"{len(rows)} clouds", ["fact", "fitted", "in use"], lines)], markdown)


def scan_tables(rows: list[dict]) -> Tables:
    """A line for each scan, with the verdict."""
    header = ["cloud", "points", "CPU s", "angle", "eigenvalues", "apart", "loops", "genus", "parts", "probability"]

    def cells(row):
        values = [number(MEDIANS[name](row), 2) for name in ("angle", "eigenvalues", "apart")]
        mesh = [str(row["skeletons"]["loops"][0]), str(row["mesh"]["genus"]), str(row["mesh"]["solids"])]
        first = [str(row["points"]["given"]), number(row["cpu"], 1)]
        return [*first, *values, *mesh, number(row["probability"], 2)]

    lines = cells_of(rows, ["cloud"], cells, 9)
    for line, row in zip(lines, rows, strict=True):
        line[-1] = row.get("verdict", line[-1])
    return [("Cross-checks", [*header, "note"], lines)]


@study(app, scan_tables)
def scans(files: Annotated[list[Path], typer.Argument(metavar="SCAN...", exists=True)], jobs: Jobs = 2) -> list[dict]:
    """What the check says of some scans."""
    return run(checked, [(dict(cloud=path.stem), (path,)) for path in files], jobs)
