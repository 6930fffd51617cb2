"""What the cross-check says of clouds whose axis is known, of meshes, and of scans.

python benchmarks/crosscheck.py verdicts --builtin

The README beside this file says what each command shows.
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
from _clouds import Case, cases
from _runs import Folders, Jobs, Markdown, Output, Own, Shapes, Variants, application, run
from _tables import good, grouped, number, present, save
from glsk_bench.repeating import spread
from glsk_bench.scoring import score
from glsk_bench.truths import read_axis
from scipy.optimize import minimize

from glsk_o3d import read_cloud, skeletonize
from glsk_o3d.apps.crosscheck import cross_check
from glsk_o3d.apps.crosscheck.agreement import VERDICTS, WEIGHTS, of_counts, of_limbs

STEPS = (0, 0.25, 0.5, 0.75, 0.9, 0.96, 1)  # of the reliability table
RIDGE = 0.05  # of the fit: what a weight costs
FITTED = ("constant", "solid", "limbs", "doubt")

app = application(__doc__)


def checked(cloud: Case | Path | tuple[Path, dict, bool]) -> dict:
    """The check of a cloud in numbers, and whether the graph is right if the true one is known."""
    if isinstance(cloud, Case):
        points, axis = cloud.load()
        axis = read_axis(cloud.folder / f"{cloud.shape}.npz") if cloud.folder else axis
    else:
        points = read_cloud(cloud) if isinstance(cloud, Path) else sampled(cloud[0], cloud[2])
    seconds = [time.process_time()]
    skeletonize(points)
    seconds.append(time.process_time())
    check = cross_check(points)
    seconds.append(time.process_time())
    told = check.to_dict() | dict(
        cpu=seconds[2] - seconds[1], ratio=(seconds[2] - seconds[1]) / (seconds[1] - seconds[0])
    )
    differs, limbs = of_counts(check.skeletons, check.solid), of_limbs(check.skeletons)
    facts = dict(solid=bool(differs), limbs=float(np.log1p(len(limbs))))
    told["facts"] = {name: fact * (not check.mesh.faults) for name, fact in facts.items()}
    skeleton = check.skeleton
    if isinstance(cloud, Case):
        told["right"] = score(axis, skeleton.vertices, skeleton.edges).perfect
    elif not isinstance(cloud, Path):
        known = {name: cloud[1][name] for name in ("components", "loops", "ends") if name in cloud[1]}
        found = spread([skeleton], 1.0, **known)
        told["right"] = 0 not in (found["loops"], found["ends"])
    return told


def sampled(path: Path, poisson: bool) -> np.ndarray:
    """8192 points of a mesh by area, or 4096 evenly spaced ones."""
    mesh = o3d.io.read_triangle_mesh(str(path))
    o3d.utility.random.seed(1)
    return np.asarray((mesh.sample_points_poisson_disk(4096) if poisson else mesh.sample_points_uniformly(8192)).points)


@app.command()
def verdicts(
    folders: Folders = None,
    own: Own = False,
    variant: Variants = "clean_4096,noise05_4096",
    shapes: Shapes = "",
    meshes: Annotated[Path | None, typer.Option(metavar="DIR", help="Also meshes with manifest.json.")] = None,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """How often each verdict is given, and how often the graph is right then."""
    work: list[tuple[dict, tuple]] = []
    if own or folders or not meshes:
        work += [(case.facts, (case,)) for case in cases(folders, own, variant, shapes)]
    for known in json.loads((meshes / "manifest.json").read_text())["meshes"] if meshes else ():
        if known["loops"] is not None or known["ends"] is not None:
            place = meshes / f"{known['name']}.ply"
            for poisson, name in enumerate(("by area", "evenly spaced")):
                row = dict(variant=name, shape=known["name"], family="meshes")
                work.append((row, ((place, known, bool(poisson)),)))
    rows = run(checked, work, jobs)
    save(output, rows)
    tell(rows, markdown)


@app.command()
def fit(
    files: Annotated[list[Path], typer.Argument(metavar="JSON...", exists=True)], markdown: Markdown = False
) -> None:
    """The weights of the probability, fitted to rows that `verdicts -o` has saved."""
    rows = [row for file in files for row in good(json.loads(file.read_text())["rows"])]
    values = np.array([[1.0, row["facts"]["solid"], row["facts"]["limbs"], row["skeletons"]["doubt"]] for row in rows])
    right = np.array([row["right"] for row in rows])

    def loss(weights: np.ndarray) -> float:
        total = np.where(right, -1, 1) * (values @ weights)
        return float(np.logaddexp(0, total).sum() + RIDGE / 2 * (weights[1:] ** 2).sum())

    weights = minimize(loss, np.zeros(len(FITTED))).x
    lines = [[name, number(found, 2), number(WEIGHTS[name], 1)] for name, found in zip(FITTED, weights, strict=True)]
    present([(f"{len(rows)} clouds", ["fact", "fitted", "in use"], lines)], markdown)


def tell(rows: list[dict], markdown: bool) -> None:
    """Verdicts by family, what the promises come to, and how the probability is to be taken."""
    lines, found = [], good(rows)
    for name, here in [*grouped(rows, "family").items(), ("all", rows)]:
        for variant in [*dict.fromkeys(row["variant"] for row in here)] if name != "all" else [""]:
            some = [row for row in good(here) if variant in ("", row["variant"])]
            count = Counter((row["verdict"], row["right"]) for row in some)
            words = [f"{count[it, True]} / {count[it, True] + count[it, False]}" for it in VERDICTS]
            told = [np.median([pick(row) for row in some]) if some else np.nan for pick in PICKED.values()]
            lines.append(
                [f"{name} {variant}".removesuffix("_4096").strip(), *words, *(number(value, 2) for value in told)]
            )
    noisy = np.array([row["variant"].startswith("noise") for row in found], bool)
    verdict, right = np.array([row["verdict"] for row in found]), np.array([row["right"] for row in found], bool)
    shares = {
        "of 'agrees' the graph is right": right[verdict == VERDICTS[0]],
        "of wrong graphs 'agrees'": (verdict == VERDICTS[0])[~right],
        "of right graphs 'agrees'": (verdict == VERDICTS[0])[right],
        "of clean clouds 'cannot tell'": (verdict == VERDICTS[3])[~noisy],
        "of noisy clouds 'cannot tell'": (verdict == VERDICTS[3])[noisy],
    }
    promises = [
        [name, str(len(held)), number(100 * held.mean(), 1) if len(held) else "-"] for name, held in shares.items()
    ]
    said, steps = np.array([row["probability"] for row in found]), []
    for low, high in pairwise(STEPS):
        here = (low <= said) & (said < high) & (verdict != VERDICTS[3])
        if here.any():
            steps.append(
                [f"{low} to {high}", str(here.sum()), number(said[here].mean(), 2), number(right[here].mean(), 2)]
            )
    tables = [
        ("Right graphs / verdicts", ["clouds", *VERDICTS, *PICKED], lines),
        ("Shares", ["share", "clouds", "%"], promises),
        ("Probability", ["said", "clouds", "mean", "right"], steps),
    ]
    failed = [row for row in rows if "failure" in row]
    present(tables, markdown)
    for row in failed:
        typer.echo(f"{row['shape']} {row['variant']}: {row['failure']}", err=True)


PICKED = {
    "angle": lambda row: row["rows"]["angle"].get("median", np.nan),
    "eigenvalues": lambda row: row["rows"]["eigenvalue_ratio"],
    "apart": lambda row: row["skeletons"]["distance_in_radii"],
    "CPU ratio": lambda row: row["ratio"],
}
"""Medians in the table of verdicts: the last is the check's CPU seconds over those of the skeleton alone."""


@app.command()
def scans(
    files: Annotated[list[Path], typer.Argument(metavar="SCAN...", exists=True)],
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """What the check says of some scans."""
    rows = run(checked, [(dict(cloud=path.stem), (path,)) for path in files], jobs)
    save(output, rows)
    header = ["cloud", "points", "CPU s", "angle", "eigenvalues", "apart", "loops", "genus", "parts", "probability"]
    lines = []
    for row in rows:
        if "failure" in row:
            lines.append([row["cloud"], *["-"] * 9, row["failure"]])
            continue
        values = [number(pick(row), 2) for name, pick in PICKED.items() if name != "CPU ratio"]
        mesh = [str(row["skeletons"]["loops"][0]), str(row["mesh"]["genus"]), str(row["mesh"]["solids"])]
        first = [row["cloud"], str(row["points"]["given"]), number(row["cpu"], 1)]
        lines.append([*first, *values, *mesh, number(row["probability"], 2), row["verdict"]])
    present([("Cross-checks", [*header, "note"], lines)], markdown)


if __name__ == "__main__":
    app()
