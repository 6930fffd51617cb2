"""Whether the score of a skeleton is calibrated, and what its verdict says of right and of wrong graphs."""

from __future__ import annotations

from itertools import product
from typing import Annotated

import numpy as np
import typer
from glsk_bench.clouds import cloud
from glsk_bench.scoring import score
from glsk_bench.shapes import FAMILIES, shape

from glsk_o3d import Verdict
from glsk_o3d.pipelines import default

from .runs import FirstPage, Jobs, Output, application, publish, run
from .tables import Table, Tables, good, grouped, number

VARIANTS = ("clean", "scan2", "noise1", "holes", "depth2")
STEPS = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.01)  # of the score
app = application(__doc__)


def measure(family: str, seed: int) -> dict:
    """Scores and verdicts of all clouds of a shape, and which graphs are right: components, loops and all ends."""
    truth = shape(family, seed)
    skeletons = [default()(cloud(truth, variant, 4096)) for variant in VARIANTS]
    return {
        "score": [skeleton.score for skeleton in skeletons],
        "verdict": [skeleton.verdict.value for skeleton in skeletons],
        "right": [bool(score(truth, it.vertices, it.edges).perfect) for it in skeletons],
    }


def tables(rows: list[dict]) -> Tables:
    """How often graphs with about one score are right, and the verdicts of right and of wrong graphs by family."""
    values, right = (np.concatenate([row[name] for row in good(rows)]) for name in ("score", "right"))
    step, lines = np.digitize(values, STEPS) - 1, []
    for at in np.unique(step):
        those = step == at
        within = f"{STEPS[at]:.2f} to {min(STEPS[at + 1], 1):.2f}"
        lines.append([within, str(those.sum()), number(values[those].mean(), 2), number(right[those].mean(), 2)])
    calibration: Table = ("graphs by their score", ["score", "clouds", "mean score", "right"], lines)
    families = {"all": good(rows), **grouped(good(rows), "family")}
    header = ["family", "clouds", "right", "not good, of right", "good, of wrong"]
    return [calibration, ("verdicts", header, [[name, *verdicts(group)] for name, group in families.items()])]


def verdicts(rows: list[dict]) -> list[str]:
    """Clouds, and the shares of right graphs, of right ones that are not called good, and of wrong ones that are."""
    right = np.concatenate([row["right"] for row in rows]).astype(bool)
    is_good = np.concatenate([row["verdict"] for row in rows]) == Verdict.GOOD.value
    shares = (values.mean() if len(values) else np.nan for values in (right, ~is_good[right], is_good[~right]))
    return [str(len(right)), *(number(share, 2) for share in shares)]


@app.command()
def main(
    page: FirstPage = None,
    first: Annotated[int, typer.Option(min=0, help="Seed of the first shape of each family.")] = 100,
    shapes: Annotated[int, typer.Option(min=1, help="Of each family.")] = 6,
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """Measure on the shapes of the public benchmark, print the tables, and put them into a page."""
    wanted = product([*FAMILIES["v1"], *FAMILIES["v2"]], range(first, first + shapes))
    rows = run(measure, [(dict(family=family, seed=seed), (family, seed)) for family, seed in wanted], jobs)
    publish(rows, tables, output, page=page, part="verdicts")
