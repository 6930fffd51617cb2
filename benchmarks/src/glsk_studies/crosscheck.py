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
from statistics import fmean
from typing import Annotated

import numpy as np
import open3d as o3d
import typer
from glsk_bench.repeating import spread
from glsk_bench.scoring import score
from glsk_bench.truths import read_axis

from glsk_o3d import read_cloud, skeletonize
from glsk_o3d.apps.crosscheck import cross_check
from glsk_o3d.apps.crosscheck.agreement import VERDICTS, WEIGHTS, of_counts, of_limbs

from .calibrate import logistic_weights
from .clouds import Case, cases
from .runs import Folders, Jobs, Output, Own, Shapes, Variants, application, publish, run
from .tables import Table, Tables, fixed, good, grouped, middle, number, present, read, table

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
    found = good(rows)
    groups = {
        f"{family} {variant}".removesuffix("_4096"): here
        for family, those in grouped(found, "family").items()
        for variant, here in grouped(those, "variant").items()
    }
    lines = [[name, *verdict_cells(here)] for name, here in {**groups, "all": found}.items()]
    tables = [("Right graphs / verdicts", ["clouds", *VERDICTS, *MEDIANS], lines), share_table(found)]
    failed = [[row["shape"], row["variant"], row["failure"]] for row in rows if "failure" in row]
    return [*tables, step_table(found), *([("Failures", ["shape", "variant", "note"], failed)] if failed else [])]


def verdict_cells(rows: list[dict]) -> list[str]:
    """How many graphs are right, of how many with each verdict; and medians."""
    count = Counter((row["verdict"], row["right"]) for row in rows)
    cells = [f"{count[it, True]} / {count[it, True] + count[it, False]}" for it in VERDICTS]
    return cells + [number(middle(rows, of), 2) for of in MEDIANS.values()]


def share_table(rows: list[dict]) -> Table:
    """What the promises come to."""
    noisy = np.array([row["variant"].startswith("noise") for row in rows], bool)
    right = np.array([row["right"] for row in rows], bool)
    agrees, unknown = (np.array([row["verdict"] == it for row in rows], bool) for it in (AGREES, CANNOT_TELL))
    shares = {
        "of 'agrees' the graph is right": right[agrees],
        "of wrong graphs 'agrees'": agrees[~right],
        "of right graphs 'agrees'": agrees[right],
        "of clean clouds 'cannot tell'": unknown[~noisy],
        "of noisy clouds 'cannot tell'": unknown[noisy],
    }
    lines = [[it, str(len(held)), number(100 * held.mean(), 1) if len(held) else "-"] for it, held in shares.items()]
    return "Shares", ["share", "clouds", "%"], lines


def step_table(rows: list[dict]) -> Table:
    """How often the graph is right, by steps of the probability."""
    known, lines = [row for row in rows if row["verdict"] != CANNOT_TELL], []
    for low, high in pairwise(STEPS):
        if here := [row for row in known if low <= row["probability"] < high]:
            means = [number(fmean(row[fact] for row in here), 2) for fact in ("probability", "right")]
            lines.append([f"{low} to {high}", str(len(here)), *means])
    return "Probability", ["said", "clouds", "mean", "right"], lines


@app.command()
def verdicts(
    folders: Folders = None,
    own: Own = False,
    variant: Variants = "clean_4096,noise05_4096",
    shapes: Shapes = "",
    meshes: Annotated[Path | None, typer.Option(metavar="DIR", help="Also meshes with manifest.json.")] = None,
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """How often each verdict is given, and how often the graph is right then."""
    work: list[tuple[dict, tuple]] = []
    if own or folders or not meshes:
        work += [(case.facts, (case,)) for case in cases(folders, own, variant, shapes)]
    for known in json.loads((meshes / "manifest.json").read_text())["meshes"] if meshes else ():
        if known["loops"] is not None or known["ends"] is not None:
            for poisson, name in enumerate(("by area", "evenly spaced")):
                facts = dict(variant=name, shape=known["name"], family="meshes")
                work.append((facts, ((meshes / f"{known['name']}.ply", known, bool(poisson)),)))
    publish(run(checked, work, jobs), verdict_tables, output)


@app.command()
def fit(files: Annotated[list[Path], typer.Argument(metavar="JSON...", exists=True)]) -> None:
    """The weights of the probability, fitted to rows that `verdicts -o` has saved."""
    rows = [row for file in files for row in good(read(file)["rows"])]
    facts = np.array([[row["facts"]["solid"], row["facts"]["limbs"], row["skeletons"]["doubt"]] for row in rows])
    weights = logistic_weights(facts, np.array([row["right"] for row in rows], bool), RIDGE)
    lines = [[name, number(it, 2), number(WEIGHTS[name], 1)] for name, it in zip(FITTED, weights, strict=True)]
    present([(f"{len(rows)} clouds", ["fact", "fitted", "in use"], lines)])


def scan_tables(rows: list[dict]) -> Tables:
    """A line for each scan, with the verdict."""
    columns = {"cloud": "cloud", "points": lambda row: row["points"]["given"], "CPU s": fixed("cpu", 1)}
    columns |= {name: lambda row, of=MEDIANS[name]: number(of(row), 2) for name in ("angle", "eigenvalues", "apart")}
    columns |= {"loops": lambda row: row["skeletons"]["loops"][0], "genus": lambda row: row["mesh"]["genus"]}
    columns |= {"parts": lambda row: row["mesh"]["solids"], "probability": fixed("probability"), "verdict": "verdict"}
    return [table("Cross-checks", rows, columns)]


@app.command()
def scans(
    files: Annotated[list[Path], typer.Argument(metavar="SCAN...", exists=True)], jobs: Jobs = 2, output: Output = None
) -> None:
    """What the check says of some scans."""
    publish(run(checked, [(dict(cloud=path.stem), (path,)) for path in files], jobs), scan_tables, output)
