"""Probabilities of the refiner's decisions: their weights fitted, and whether what they predict holds as often.

python benchmarks/calibrate.py check --builtin --variant clean_1024,noise2_1024

The README of the benchmarks says what each command shows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from glsk_bench.table import mean_with_interval, told
from scipy.optimize import minimize
from scipy.special import expit
from scipy.stats import mannwhitneyu

from glsk_o3d.analysis import compare
from glsk_o3d.data.decisions import logistic
from glsk_o3d.filters.refiner import QUESTIONS as ORDER
from glsk_o3d.pipelines import default

from .clouds import Case, cases
from .questions import questions
from .runs import Jobs, Output, Own, Page, Saved, Shapes, Variants, application, publish, run
from .tables import BLUE, GREY, Tables, fill, grouped, keep, number, pick, present, read, save, sheet

PENALTY = 1.0  # of half a weight's square, as if it were drawn from a normal distribution; the constant has none
PARTS = 5  # of the range of probabilities, of the same width
SURE = 1e-9  # a probability is taken to be as far from 0 and 1, or one mistake would make the loss infinite
ASKED = {question.about: question for question in ORDER}
QUESTIONS = {
    "loop": "a loop is a handle",
    "air": "a branch crosses air",
    "gap": "the object goes on across a gap",
    "limb": "a branch is a limb",
}
SEEN, UNSEEN = "all families", "the other families"  # to which weights are fitted
MEASURES = ("topology", "perfect")
EVERY = "*_4096"
Question = dict  # its `facts`, whether it `is_so`, of which `shape` and `family` it is, and its `share`
Weights = dict[str, dict[str, float]]
Judged = Mapping[str, tuple[np.ndarray, list[Question]]]  # probabilities, (n,), by what the questions are about
Sources = Annotated[
    list[Path] | None,
    typer.Argument(metavar="DIR|JSON", exists=True, help="Folders of shapes, or questions that -o has written."),
]

app = application(__doc__)


def by_question(rows: list[dict]) -> dict[str, list[Question]]:
    """The questions of all clouds, by what they are about, each with its `share` of those of its cloud."""
    found: dict[str, list[Question]] = {about: [] for about in QUESTIONS}
    for row, about in product(rows, QUESTIONS):
        here = pick(row.get("questions", ()), about=about)
        facts = dict(shape=row["shape"], family=row["family"], share=1 / max(len(here), 1))
        found[about] += [it | facts for it in here]
    return {about: asked for about, asked in found.items() if asked}


def answers(asked: list[Question]) -> np.ndarray:
    """Whether it is so, (n,) bool array."""
    return np.array([it["is_so"] for it in asked], bool)


def fitted(asked: list[Question]) -> dict[str, float]:
    """The weights with which the questions are answered best; each cloud counts once, however many questions it has."""
    names = list(asked[0]["facts"])
    facts = np.array([[it["facts"][name] for name in names] for it in asked])
    share = np.array([it["share"] for it in asked])
    weights = logistic_weights(facts, answers(asked), PENALTY, share / share.mean())
    return dict(zip(["constant", *names], weights.tolist(), strict=True))


def logistic_weights(
    facts: np.ndarray, is_so: np.ndarray, penalty: float, share: np.ndarray | float = 1.0
) -> np.ndarray:
    """A constant and a weight for each fact, (1 + f,) float array: least log loss, with a light L2 penalty.

    Each of the (n, f) facts counts by its `share` (n,).
    """
    table = np.column_stack([np.ones(len(facts)), facts])
    penalties = penalty * np.append(0, np.ones(facts.shape[1]))

    def loss(weights):
        total = table @ weights
        value = (share * np.logaddexp(0, np.where(is_so, -total, total))).sum() + penalties @ weights**2 / 2
        return value, table.T @ (share * (expit(total) - is_so)) + penalties * weights

    return minimize(loss, np.zeros(table.shape[1]), jac=True, method="BFGS").x


def said(weights: Mapping[str, float], asked: list[Question]) -> np.ndarray:
    """Probabilities, (n,) float array."""
    return np.array([logistic(weights, it["facts"]) for it in asked])


def said_by_others(asked: list[Question], learnt: list[Question]) -> np.ndarray:
    """What weights say of each family that were fitted without it, to other questions, (n,) float array."""
    families = {it["family"] for it in asked}
    weights = {family: fitted([it for it in learnt if it["family"] != family]) for family in families}
    return np.array([logistic(weights[it["family"]], it["facts"]) for it in asked])


def log_loss(chance: np.ndarray, is_so: np.ndarray) -> float:
    """Mean of minus the logarithm of the probability of what is so, in nats."""
    chance = np.clip(chance, SURE, 1 - SURE)
    return float(-np.log(np.where(is_so, chance, 1 - chance)).mean())


def area_under_curve(chance: np.ndarray, is_so: np.ndarray) -> float:
    """The share of pairs, of one that is so and one that is not, in which that has the larger probability; ties half.

    NaN without such pairs.
    """
    if is_so.all() or not is_so.any():
        return np.nan
    return mannwhitneyu(chance[is_so], chance[~is_so]).statistic / (is_so.sum() * (~is_so).sum())


def parts(chance: np.ndarray, asked: list[Question]) -> list[tuple[int, float, tuple[float, float, float]]]:
    """Of every part of the range that is not empty: the count, the mean probability, and how often it is so."""
    part, is_so, found = np.minimum((chance * PARTS).astype(int), PARTS - 1), answers(asked), []
    for k in np.unique(part):
        rows = np.flatnonzero(part == k)
        often = mean_with_interval([asked[i]["shape"] for i in rows], is_so[rows])
        found.append((len(rows), float(chance[rows].mean()), often))
    return found


def tables(judged: Judged) -> Tables:
    """A line for each kind of question; what is said and how often it is so, by parts of the range; and by family."""
    kinds, ranges, families = [], [], []
    for about, (chance, asked) in judged.items():
        question, is_so = QUESTIONS[about], answers(asked)
        count, so, probability, *losses = _cells(chance, is_so)
        kinds.append([question, count, so, probability, number(((chance >= 0.5) == is_so).mean()), *losses])
        for place, (n, mean, often) in enumerate(parts(chance, asked)):
            ranges.append([question * (place == 0), str(n), number(mean, 2), told(*often)])
        for place, family in enumerate(dict.fromkeys(it["family"] for it in asked)):
            here = np.array([it["family"] == family for it in asked])
            families.append([question * (place == 0), family, *_cells(chance[here], is_so[here])])
    first, last = ["asked", "so", "said"], ["log loss", "of the share", "AUC"]
    return [
        ("by question", ["the question", *first, "right at .5", *last], kinds),
        ("said, and so how often", ["the question", "asked", "said", "so"], ranges),
        ("by family", ["the question", "family", *first, *last], families),
    ]


def _cells(chance, is_so):
    """How many there are, how often it is so, what is said on average, and how good that is."""
    shares = [number(is_so.mean()), number(chance.mean())]
    losses = [number(log_loss(chance, is_so)), number(log_loss(np.full(len(is_so), is_so.mean()), is_so))]
    return [str(len(is_so)), *shares, *losses, number(area_under_curve(chance, is_so))]


def draw_reliability(judged: Judged, folder: Path) -> None:
    """How often it is so over the probability that was said, a panel for each kind of question, with counts."""
    figure, panels = sheet(5.4, rows=2, columns=2, sharex=True, sharey=True)
    for axes, (about, question) in zip(panels.ravel(), QUESTIONS.items(), strict=True):
        axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8, zorder=0)
        axes.set_title(question, fontsize=9)
        axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), aspect="equal")
        for count, mean, (often, low, high) in parts(*judged[about]) if about in judged else ():
            axes.vlines(mean, low, high, color=BLUE, linewidth=1.5)
            axes.plot(mean, often, "o", color=BLUE, markersize=5)
            right = mean < 0.8  # of the dot, or there is no room
            style = dict(textcoords="offset points", fontsize=7, color=GREY, va="center")
            axes.annotate(str(count), (mean, often), (6 if right else -6, 0), ha="left" if right else "right", **style)
    figure.supxlabel("probability that was said", fontsize=9)
    figure.supylabel("how often it was so", fontsize=9)
    keep(figure, folder, "probabilities")


def measure(case: Case, weights: Weights) -> dict[str, float]:
    """A skeleton of `default` with these weights, against its axis."""
    points, truth = case.load()
    kept = {about: ASKED[about].weights for about in weights}
    try:
        for about, others in weights.items():
            ASKED[about].weights = others
        return asdict(compare(default()(points), truth))
    finally:
        for about, own in kept.items():
            ASKED[about].weights = own


def transfer_tables(rows: list[dict]) -> Tables:
    """By family: shares with weights fitted to all families, with those fitted to the others, and the difference."""
    lines = []
    for family, here in {**grouped(rows, "family"), "all": rows}.items():
        seen, unseen = pick(here, weights=SEEN), pick(here, weights=UNSEEN)  # the same clouds in the same order
        cells = []
        for name in MEASURES:
            sides = [np.array([bool(row.get(name)) for row in side], float) for side in (seen, unseen)]
            change = mean_with_interval([row["shape"] for row in seen], sides[1] - sides[0])
            cells += [*(number(side.mean(), 2) for side in sides), told(*change, 2, sign="+")]
        lines.append([family, str(len(seen)), *cells])
    header = [f"{name}{word}" for name in MEASURES for word in (", all", ", others", ": change")]
    return [("weights fitted to all families, and to the others", ["family", "clouds", *header], lines)]


def rows_of(sources: list[Path] | None, own: bool, variant: str, shapes: str, jobs: int) -> list[dict]:
    """The questions about every cloud, a row each; saved ones are not asked again."""
    saved = [path for path in sources or () if path.is_file()]
    rows = [row for path in saved for row in read(path)["rows"]]
    if folders := [path for path in sources or () if path.is_dir()] or not saved:
        found = cases(folders if sources else None, own, variant, shapes)
        rows += run(questions, [(case.facts, (case, default())) for case in found], jobs)
    for row in rows:
        if "failure" in row:
            typer.echo(f"{row['shape']} {row['variant']}: {row['failure']}", err=True)
    return rows


@app.command()
def fit(
    sources: Sources = None,
    own: Own = False,
    variant: Variants = EVERY,
    shapes: Shapes = "",
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """The weights with which the questions are answered best, as the classes of the questions have them."""
    rows = rows_of(sources, own, variant, shapes, jobs)
    save(output, rows)
    for about, asked in by_question(rows).items():
        lines = [f'    "{name}": {weight:.2f},' for name, weight in fitted(asked).items()]
        typer.echo("\n".join([f"{about} = {{", *lines, "}"]))


@app.command()
def check(
    sources: Sources = None,
    own: Own = False,
    variant: Variants = EVERY,
    shapes: Shapes = "",
    leave_family_out: Annotated[
        bool, typer.Option("--leave-family-out", help="For each family, weights that were fitted to the others.")
    ] = False,
    learnt: Annotated[
        Path | None,
        typer.Option("--from", metavar="JSON", exists=True, dir_okay=False, help="Fitted to these, else to the same."),
    ] = None,
    page: Page = None,
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """Whether what has some probability is so as often."""
    rows = rows_of(sources, own, variant, shapes, jobs)
    save(output, rows)
    found = by_question(rows)
    others = by_question(read(learnt)["rows"]) if learnt else found
    judged = {
        about: (said_by_others(it, others[about]) if leave_family_out else said(ASKED[about].weights, it), it)
        for about, it in found.items()
    }
    shown = tables(judged)
    present(shown)
    if page is not None:
        fill(page, {"check": shown})
        draw_reliability(judged, page.parent / "images")


@app.command()
def transfer(
    learnt: Saved,
    folder: Annotated[Path, typer.Argument(metavar="DIR", exists=True, file_okay=False, help="Other shapes.")],
    variant: Variants = "*",
    shapes: Shapes = "",
    jobs: Jobs = 2,
    output: Output = None,
    page: Page = None,
) -> None:
    """Right topologies with weights fitted to all families, and for each family with those fitted to the others."""
    known = by_question(read(learnt)["rows"])
    found = cases(folder, False, variant, shapes)
    seen = {about: fitted(asked) for about, asked in known.items()}
    unseen = {
        family: {about: fitted([it for it in asked if it["family"] != family]) for about, asked in known.items()}
        for family in {case.facts["family"] for case in found}
    }
    work = [(dict(weights=SEEN, **case.facts), (case, seen)) for case in found]
    work += [(dict(weights=UNSEEN, **case.facts), (case, unseen[case.facts["family"]])) for case in found]
    publish(run(measure, work, jobs), transfer_tables, output, page, "transfer")
