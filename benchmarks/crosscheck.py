"""What the cross-check says of clouds whose axis is known, and how near both Laplacians come to the true curvature.

python benchmarks/crosscheck.py verdicts --builtin

The README beside this file says what each command shows.
"""

from __future__ import annotations

import time
from collections import Counter
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from _clouds import Case, cases
from _runs import Folder, Jobs, Markdown, Output, Own, Shapes, Variants, application, run
from _tables import number, present, save

from glsk_o3d import RingBuilder, read_cloud, samples
from glsk_o3d.analysis import compare
from glsk_o3d.crosscheck import cross_check
from glsk_o3d.crosscheck.agreement import VERDICTS
from glsk_o3d.crosscheck.mesh import ball_pivoting, curvature_normals, mesh_areas, mesh_laplacian, ring_areas
from glsk_o3d.crosscheck.mesh_rings import umbrellas
from glsk_o3d.numerics.cotangent import cotangent_laplacian

EVERY = "clean_1024,clean_4096,density_4096,holes_4096,scan2_4096,noise1_4096,noise2_4096,outliers_4096"
GOOD = dict(error=0.4, inside=0.9, completeness=0.9)  # and the right topology: a skeleton that deserves trust

app = application(__doc__)


def checked(cloud: Case | Path) -> dict:
    """The check of a cloud in numbers, and whether its skeleton is good if the axis is known."""
    points, axis = (read_cloud(cloud), None) if isinstance(cloud, Path) else cloud.load()
    start = time.process_time()
    check = cross_check(points)
    seconds = time.process_time() - start
    told = check.to_dict() | dict(cpu=seconds)
    if axis is not None:
        true = compare(check.skeleton, axis)
        near = true.error < GOOD["error"] and min(true.inside, true.completeness) > GOOD["inside"]
        told |= dict(error=true.error, good=bool(near and true.topology))
    return told


@app.command()
def verdicts(
    folder: Folder = None,
    own: Own = False,
    variant: Variants = EVERY,
    shapes: Shapes = "",
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """How often each verdict is given, and how often it is right."""
    found = cases(folder, own, variant, shapes)
    rows = run(checked, [(case.facts, (case,)) for case in found], jobs)
    save(output, rows)
    lines = []
    for name in (*dict.fromkeys(case.variant for case in found), "all"):
        here = [row for row in rows if "failure" not in row and name in (row["variant"], "all")]
        good = Counter((row["verdict"], row["good"]) for row in here)
        failed = [row for row in rows if "failure" in row and name in (row["variant"], "all")]
        note = f"{len(failed)} failed: {failed[0]['failure']}" if failed else ""
        words = [f"{good[verdict, True]} / {good[verdict, True] + good[verdict, False]}" for verdict in VERDICTS]
        angle = np.median([row["rows"]["angle"].get("median", np.nan) for row in here] or [np.nan])
        apart = np.median([row["skeletons"]["distance_in_radii"] for row in here] or [np.nan])
        poisson = sum(row["surface"] == "poisson" for row in here)
        lines.append([name, *words, number(angle, 1), number(apart, 2), str(poisson), note])
    header = ["clouds", *VERDICTS, "angle", "apart", "by poisson", "note"]
    present([("Good skeletons / verdicts", header, lines)], markdown)


def curved(shape: str, n: int) -> dict:
    """Errors of the mean curvature normals of rings and of a ball-pivoting mesh, both with mixed Voronoi areas."""
    points, radius = _curved_cloud(shape, n)
    state = RingBuilder()(points)
    cloud = state.frame.out_of(state.cloud)
    _, faces = ball_pivoting(state)
    exact = -cloud * [0, 1, 1] / radius**2 if shape == "cylinder" else -2 * cloud / radius**2
    told = {}
    for name, laplacian, areas, whole in (
        ("ours", cotangent_laplacian(cloud, state.rings), ring_areas(cloud, state.rings), state.rings.closed),
        ("mesh", mesh_laplacian(cloud, faces), mesh_areas(cloud, faces), umbrellas(n, faces)),
    ):
        found, true = curvature_normals(laplacian, areas, cloud)[whole], exact[whole]
        size, wanted = np.linalg.norm(found, axis=1), np.linalg.norm(true, axis=1)
        along = np.einsum("ij,ij->i", found, true) / wanted
        angle = np.degrees(np.arccos(np.clip(along / size, -1, 1)))
        told[name] = dict(
            angle=np.percentile(angle, [50, 90]).tolist(),
            length=np.percentile(np.abs(size / wanted - 1), [50, 90]).tolist(),
            mean=float(np.average(along / wanted, weights=areas[whole])),
        )
    return told


def _curved_cloud(shape, n):
    if shape == "cylinder":
        return samples.tube(n, capped=False).points, 0.1
    if shape == "sphere":
        return samples.sphere(n).points, 0.5
    i = np.arange(n) + 0.5  # a Fibonacci lattice
    z, turn = 1 - 2 * i / n, np.pi * (1 + np.sqrt(5)) * i
    return np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z]) / 2, 0.5


@app.command()
def curvature(
    sizes: Annotated[str, typer.Option(metavar="NUMBERS", help="Points, with commas.")] = "500,2000,8000,32000",
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """How near the Laplacians of rings and of a mesh come to the exact curvature of spheres and cylinders."""
    shapes = ("even sphere", "sphere", "cylinder")
    work = [(dict(shape=shape, points=int(n)), (shape, int(n))) for shape in shapes for n in sizes.split(",")]
    rows = run(curved, work, jobs)
    save(output, rows)
    header = ["surface", "points", "of", "angle", "90 %", "length", "90 %", "mean", "note"]
    lines = []
    for row in rows:
        for name in ("ours", "mesh"):
            here = row.get(name)
            words = (
                [number(value, 3) for value in (*here["angle"], *here["length"], here["mean"])] if here else ["-"] * 5
            )
            lines.append([row["shape"], str(row["points"]), name, *words, row.get("failure", "")])
    present([("Off the exact mean curvature normal: degrees, and relative", header, lines)], markdown)


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
    header = ["cloud", "points", "CPU s", "covered", "same rings", "angle", "90 %", "apart", "95 %"]
    header += ["components", "loops", "note"]
    lines = []
    for row in rows:
        if "failure" in row:
            lines.append([row["cloud"], *["-"] * 10, row["failure"]])
            continue
        of, apart = row["rows"], row["skeletons"]
        angles = [number(of["angle"].get(name), 1) for name in ("median", "p90")]
        distances = [number(apart[name], 2) for name in ("distance_in_radii", "hausdorff95_in_radii")]
        counts = ["{}, {}".format(*apart[name]) for name in ("components", "loops")]
        shares = [number(of[name], 2) for name in ("covered", "same_rings")]
        facts = [str(row["points"]["used"]), number(row["cpu"], 1), *shares]
        mesh = f"{row['verdict']} ({row['surface'].replace('_', ' ')})"
        lines.append([row["cloud"], *facts, *angles, *distances, *counts, mesh])
    present([("Cross-checks", header, lines)], markdown)


if __name__ == "__main__":
    app()
