"""What right topologies cost where the weights have not seen a family: each with weights fitted to the others."""

from __future__ import annotations

from collections.abc import Mapping

from _common.clouds import Case
from _common.results import pick
from _common.tables import Table, number
from glsk_bench.table import mean_with_interval, told

from glsk_o3d.analysis import compare
from glsk_o3d.pipelines import default
from glsk_o3d.refinement import scores

from .fitting import WEIGHTS, Answered, fitted

SEEN, UNSEEN = "all families", "the other families"  # to which weights are fitted
MEASURES = ("topology", "perfect")
Weights = dict[str, dict[str, float]]


def weights_of(answered: Mapping[str, Answered], without: str | None = None) -> Weights:
    """By the names of `scores`: fitted to all questions, or to those of all families but one."""
    some = {about: it if without is None else it.of(it.families != without) for about, it in answered.items()}
    return {WEIGHTS[about]: fitted(it) for about, it in some.items()}


def measure(case: Case, weights: Weights) -> dict[str, float]:
    """A skeleton of `default` with these weights, against its axis."""
    points, truth = case.load()
    kept = {name: dict(getattr(scores, name)) for name in weights}
    try:
        for name, them in weights.items():
            getattr(scores, name).update(them)
        return compare(default()(points), truth).as_dict()
    finally:
        for name, them in kept.items():
            getattr(scores, name).update(them)


def table(rows: list[dict]) -> Table:
    """By family: shares with weights fitted to all families, with those fitted to the others, and the difference."""
    lines = []
    for family in [*dict.fromkeys(row["family"] for row in rows), "all"]:
        here = rows if family == "all" else pick(rows, family=family)
        seen, unseen = ({_cloud(row): row for row in pick(here, weights=name)} for name in (SEEN, UNSEEN))
        cells = []
        for name in MEASURES:
            sides = [[float(side[cloud].get(name, False)) for cloud in seen] for side in (seen, unseen)]
            change = mean_with_interval([shape for shape, _ in seen], [b - a for a, b in zip(*sides, strict=True)])
            cells += [*(number(sum(side) / len(seen), 2) for side in sides), told(*change, 2, sign="+")]
        lines.append([family, str(len(seen)), *cells])
    header = [f"{name}{word}" for name in MEASURES for word in (", all", ", others", ": change")]
    return "weights fitted to all families, and to the others", ["family", "clouds", *header], lines


def _cloud(row):
    return row["shape"], row["variant"]
