"""What the cross-check says of clouds whose axis is known, and of scans.

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

from glsk_o3d import read_cloud
from glsk_o3d.analysis import compare
from glsk_o3d.crosscheck import cross_check
from glsk_o3d.crosscheck.agreement import VERDICTS

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
        lines.append([name, *words, number(angle, 1), number(apart, 2), note])
    header = ["clouds", *VERDICTS, "angle", "apart", "note"]
    present([("Good skeletons / verdicts", header, lines)], markdown)


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
    header = ["cloud", "points", "CPU s", "covered", "angle", "90 %", "apart", "95 %"]
    header += ["components", "loops", "note"]
    lines = []
    for row in rows:
        if "failure" in row:
            lines.append([row["cloud"], *["-"] * 9, row["failure"]])
            continue
        of, apart = row["rows"], row["skeletons"]
        angles = [number(of["angle"].get(name), 1) for name in ("median", "p90")]
        distances = [number(apart[name], 2) for name in ("distance_in_radii", "hausdorff95_in_radii")]
        counts = ["{}, {}".format(*apart[name]) for name in ("components", "loops")]
        facts = [str(row["points"]["used"]), number(row["cpu"], 1), number(of["covered"], 2)]
        lines.append([row["cloud"], *facts, *angles, *distances, *counts, row["verdict"]])
    present([("Cross-checks", header, lines)], markdown)


if __name__ == "__main__":
    app()
