"""How much each number that steers the default skeleton matters: its graphs with a smaller and with a larger one."""

from __future__ import annotations

import sys
from ast import literal_eval
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import cache
from itertools import product
from typing import Annotated, Any

import numpy as np
import typer
from glsk_bench.clouds import cloud
from glsk_bench.scoring import score
from glsk_bench.shapes import FAMILIES, shape

from glsk_o3d import Pipeline
from glsk_o3d.cli.overrides import override
from glsk_o3d.filters.refiner import QUESTIONS
from glsk_o3d.pipelines import default

from .runs import FirstPage, Jobs, Output, application, publish, run
from .tables import ROOT, Tables, grouped, number

FACTORS = (0.8, 1.25)
VARIANTS = ("clean", "scan2")
SHOWN = 10  # numbers in the page
app = application(__doc__)


def steering() -> list[Any]:
    """The numbers of the page of the filters, by the code that makes its table."""
    sys.path.insert(0, str(ROOT / "docs" / "_ext"))
    from steering import steering as numbers  # the site is no package

    return numbers()


def scaled(value: Any, factor: float) -> Any:
    """A number that is larger by a factor, and by one at least if it is a whole one; or a tuple of such."""
    if isinstance(value, tuple):
        return tuple(scaled(part, factor) for part in value)
    if isinstance(value, int):
        return max(round(value * factor), value + 1) if factor > 1 else min(round(value * factor), value - 1)
    return value * factor


@contextmanager
def changed(place: str, name: str, text: str, factor: float) -> Iterator[Pipeline]:
    """`default` with one of its numbers larger by a factor: an option, a weight, a field of a step, or a constant."""
    question, _, fact = name.partition(": ")
    if place[0].isupper():
        yield override(default(), [f"{place}.{name}={scaled(literal_eval(text), factor)}"])
        return
    module = sys.modules[f"glsk_o3d.{place.replace('/', '.')}"]
    steps = [value for value in vars(module).values() if is_dataclass(value) and not isinstance(value, type)]
    owners = [vars(step) for step in steps if name in {field.name for field in fields(step)}]
    if fact:
        owners, name = [next(it.weights for it in QUESTIONS if it.about == question)], fact
    elif not owners:  # every module that imports a constant has it by itself
        modules = [vars(it) for key, it in sys.modules.items() if key.startswith("glsk_o3d")]
        owners = [names for names in modules if name in names]
    before = owners[0][name]
    for names in owners:
        names[name] = scaled(before, factor)
    try:
        yield default()
    finally:
        for names in owners:
            names[name] = before


@cache
def clouds(points: int, seed: int) -> list[tuple[Any, np.ndarray]]:
    """A shape of every family and the clouds of it, with the shape."""
    shapes = [shape(family, seed) for family in (*FAMILIES["v1"], *FAMILIES["v2"])]
    return [(truth, cloud(truth, variant, points)) for truth, variant in product(shapes, VARIANTS)]


def measure(place: str, name: str, text: str, factor: float, points: int, seed: int) -> dict:
    """Graphs and scores of all clouds with one number changed."""
    graphs, right, error = [], [], []
    with changed(place, name, text, factor) as pipeline:
        for truth, sample in clouds(points, seed):
            skeleton = pipeline(sample)
            scores = score(truth, skeleton.vertices, skeleton.edges)
            graphs.append([skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)])
            right.append(bool(scores.topology))
            error.append(scores.error)
    return dict(graphs=graphs, right=right, error=error)


def tables(rows: list[dict]) -> Tables:
    """The numbers that change most graphs, and how many change none."""
    (base,) = (row for row in rows if row["factor"] == 1)
    lines = []
    for (place, name), group in grouped([row | {"key": (row["place"], row["name"])} for row in rows], "key").items():
        if group[0]["factor"] == 1:
            continue
        others = [np.any(np.not_equal(row["graphs"], base["graphs"]), axis=1).sum() for row in group]
        right = [sum(row["right"]) - sum(base["right"]) for row in group]
        moved = np.mean([np.abs(np.subtract(row["error"], base["error"])).mean() for row in group])
        lines.append(
            (
                sum(others),
                moved,
                [f"`{name}`", f"`{place}`", *map(str, others), *map("{:+d}".format, right), number(moved)],
            )
        )
    lines.sort(key=lambda line: line[:2], reverse=True)
    still = sum(line[0] == 0 for line in lines)
    header = ["number", "where", "graphs, smaller", "larger", "right, smaller", "larger", "error changes by"]
    clouds = f"{len(base['graphs'])} clouds, {sum(base['right'])} with the right topology"
    title = f"The {SHOWN} numbers of {len(lines)} that change most graphs of {clouds}; {still} change none"
    return [(title, header, [cells for *_, cells in lines[:SHOWN]])]


@app.command()
def main(
    page: FirstPage = None,
    points: Annotated[int, typer.Option(min=256, help="Of each cloud.")] = 2048,
    seed: Annotated[int, typer.Option(min=0, help="Of the shapes.")] = 3,
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """Measure all numbers, print the table, and put it into a page."""
    wanted = [(it.place, it.name, it.value, factor) for it in steering() for factor in FACTORS]
    wanted = [(*wanted[0][:3], 1), *wanted]
    facts = [dict(zip(("place", "name", "value", "factor"), it, strict=True)) for it in wanted]
    rows = run(measure, [(fact, (*fact.values(), points, seed)) for fact in facts], jobs)
    publish(rows, tables, output, page=page, part="sensitivity")
