"""Digests of skeletons, to show that a change of the code did not change a bit of a result.

Each cloud is skeletonised by four pipelines; three SHA-256 stand for all arrays of each result, for its decisions, and
for the rest of its report but times and versions, or the name of the error that came instead. `digest.py make
BEFORE.json` writes them, and after the change `digest.py compare BEFORE.json` makes them anew, prints a table and what
differs; exit code 1 if anything does.

It uses only what older versions of the package have too, so that it also runs with one of these on PYTHONPATH.
"""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, fields
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")  # before NumPy: sums in the same order on any machine

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import track
from rich.table import Table

import glsk_o3d as glsk
from glsk_o3d import samples

PIPELINES = ("default", "tree", "wen2024", "cao2010")
UNSTEADY = ("seconds", "versions")  # of a report: other in every run
SAMPLES = ("tube", "y_junction", "torus", "two_rings", "helix", "sauropod", "tree", "sphere", "sheet")
SHARED = Path(__file__).resolve().parents[2] / "shared"

Digests = dict[str, dict[str, dict[str, dict[str, str]]]]  # by group, cloud, pipeline and part of the result

app = typer.Typer(add_completion=False, help=__doc__, pretty_exceptions_enable=False, rich_markup_mode=None)
Shared = Annotated[Path, typer.Option(help="Folder with data/*.ply and truth/*.npz; left out where there is none.")]
Size = Annotated[int, typer.Option(min=8, help="Points of the truth clouds and samples.")]
Jobs = Annotated[int, typer.Option(min=1, help="Processes.")]


def clouds(shared: Path, size: int) -> Iterator[tuple[str, str, Path | str, str | int]]:
    """Group, name and source of every cloud: a path, with the name of an array in it if it has several, or a sample."""
    for path in sorted(shared.glob("data/*.ply")):
        yield "data", path.stem, path, ""
    for path in sorted(shared.glob("truth/*.npz")):
        with np.load(path) as archive:
            for variant in sorted(name for name in archive if name.endswith(f"_{size}")):
                yield f"truth {variant}", f"{path.stem} {variant}", path, variant
    for name in SAMPLES:
        yield "samples", f"{name} {size}", name, size


def digest(case: tuple[str, str, Path | str, str | int]) -> tuple[str, str, dict[str, dict[str, str]]]:
    """Group and name of a cloud, and for each pipeline the first digits of the SHA-256, or the error's name."""
    group, name, source, which = case
    if isinstance(source, str):
        points = getattr(samples, source)(which).points
    elif which:
        with np.load(source) as archive:
            points = archive[which].astype(float)
    else:
        points = np.asarray(glsk.read_cloud(source).points)
    found = {}
    for pipeline in PIPELINES:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                skeleton = glsk.skeletonize(points, pipeline)
            except glsk.GlskError as error:
                found[pipeline] = {"error": type(error).__name__}
                continue
        found[pipeline] = {part: hashlib.sha256(text).hexdigest()[:16] for part, text in parts(skeleton).items()}
    return group, name, found


def parts(skeleton: glsk.Skeleton) -> dict[str, bytes]:
    """What the digests of a skeleton are of."""
    report = asdict(skeleton.report)
    decisions = report.pop("decisions")
    for unsteady in UNSTEADY:
        for told in (report, *report["iterations"]):
            told.pop(unsteady, None)
    names = [field.name for field in fields(skeleton) if isinstance(getattr(skeleton, field.name), np.ndarray)]
    arrays = [(name, np.ascontiguousarray(getattr(skeleton, name))) for name in sorted(names)]
    held = b"".join(f"{name} {array.dtype} {array.shape}".encode() + array.tobytes() for name, array in arrays)
    return {"arrays": held, "decisions": repr(decisions).encode(), "report": repr(sorted(report.items())).encode()}


def digests(shared: Path, size: int, jobs: int) -> Digests:
    """Those of all clouds."""
    every = list(clouds(shared, size))
    found: Digests = {}
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        for group, name, told in track(pool.map(digest, every), "clouds", len(every), console=Console(stderr=True)):
            found.setdefault(group, {})[name] = told
    return found


@app.command()
def make(out: Path, shared: Shared = SHARED, size: Size = 4096, jobs: Jobs = 2) -> None:
    """Write the digests of all clouds."""
    out.write_text(json.dumps(digests(shared, size, jobs), indent=1, sort_keys=True) + "\n")


@app.command()
def compare(before: Path, shared: Shared = SHARED, size: Size = 4096, jobs: Jobs = 2) -> None:
    """Make the digests anew, and say where they differ from a file of earlier ones."""
    old, new = json.loads(before.read_text()), digests(shared, size, jobs)
    table = Table("clouds", "number", *PIPELINES, box=SIMPLE_HEAD, title="identical skeletons, to the last bit")
    changed = []
    for group in sorted({*old, *new}):
        there, here = old.get(group, {}), new.get(group, {})
        same = dict.fromkeys(PIPELINES, 0)
        for name, pipeline in product(sorted({*there, *here}), PIPELINES):
            before, now = (it.get(name, {}).get(pipeline, {}) for it in (there, here))
            same[pipeline] += before == now
            for part in sorted({*before, *now}):
                was, is_now = (it.get(part, "nothing") for it in (before, now))
                if was != is_now:
                    changed.append(f"differs: {name}, {pipeline}, {part}: {was} before, {is_now} now")
        table.add_row(group, str(len({*there, *here})), *map(str, same.values()))
    Console().print(table)
    print(*changed, sep="\n", end="\n" * bool(changed))
    raise typer.Exit(bool(changed))


if __name__ == "__main__":
    app()
