"""The table of the benchmark: means with intervals, for all clouds and for each kind, of one or several programs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.interop.atomic import write_atomically, write_json

from .scoring import MEASURES, OF_THINGS, Results
from .versions import OWN

_COLUMNS = (*MEASURES[:7], "hooks", "reach", "wiggle", "mirror", "junction_offset")  # in Markdown; JSON has them all
_HEADS = {"tips_f1": "tips F1", "junctions_f1": "junctions F1", "junction_offset": "junction offset"}
_DIGITS = {"error": 3, "wiggle": 3, "mirror": 3}
_CAPTION = (
    "Means, and in brackets 95 % intervals from drawing the shapes anew. A failure is neither perfect nor right in its "
    "topology, and its F1 are 0; what comes after these are means over the answers that could be scored. Seconds are "
    "medians."
)
RESAMPLES = 4000  # fitted: enough for two digits of an interval's ends
LEVEL = 95  # published: by habit, % of the resampled means that lie in the interval

Cell = dict[str, Any]


def mean_with_interval(shapes: Sequence[str], values: Sequence[float]) -> tuple[float, float, float]:
    """The mean of values, and the ends of its percentile bootstrap interval (Efron 1979).

    Shapes are drawn with replacement, each with all its values, since several clouds of one shape are no independent
    evidence. Means are over the values. The draws are the same every time.
    """
    if len(values) == 0:
        return np.nan, np.nan, np.nan
    names, of = np.unique(shapes, return_inverse=True)
    total, count = np.bincount(of, np.asarray(values, float)), np.bincount(of)
    times = _drawn(len(names))
    low, high = np.percentile((times @ total) / (times @ count), [50 - LEVEL / 2, 50 + LEVEL / 2])
    return float(total.sum() / count.sum()), float(low), float(high)


@lru_cache(maxsize=16)
def _drawn(n: int) -> np.ndarray:
    """(RESAMPLES, n) array: how often each of n shapes is drawn, which takes longer than all that follows."""
    return np.random.default_rng(0).multinomial(n, np.full(n, 1 / n), RESAMPLES)


def told(mean: float, low: float, high: float, digits: int = 2, sign: str = "") -> str:
    """A mean and its interval as tables show them; a dash for NaN. With the sign "+" positive ones have it."""
    if np.isnan(mean):
        return "-"
    words = [f"{round(value, digits) + 0.0:{sign}.{digits}f}" for value in (mean, low, high)]  # no -0.00
    return f"{words[0]} [{words[1]}, {words[2]}]"


@dataclass(frozen=True)
class Leaderboard:
    """Means with intervals of several programs, the best first.

    Attributes
    ----------
    benchmark : str
        As of `Results`.
    whole : bool
        Whether the clouds are all of the version, and no others.
    entries : list of dict
        For each program its `name`, what holds for `all` its answers, and by variant in `variants`: how many `clouds`
        and `shapes`, how many `failures`, the median `seconds` or None, and for each measure its mean and the ends of
        its 95 % interval, or None.

    Examples
    --------
    >>> Leaderboard("v1", True, []).as_dict()
    {'benchmark': 'v1', 'whole': True, 'entries': []}
    """

    benchmark: str
    whole: bool
    entries: list[dict[str, Any]]

    def as_dict(self) -> dict[str, Any]:
        """All of it, as JSON holds it.

        Returns
        -------
        dict
        """
        return {"benchmark": self.benchmark, "whole": self.whole, "entries": self.entries}

    def save(self, path: str | os.PathLike) -> None:
        """Write all numbers where the ending is ``.json``, else the tables in Markdown.

        Parameters
        ----------
        path : path-like
        """
        if Path(path).suffix.lower() == ".json":
            write_json(path, self.as_dict())
        else:
            write_atomically(path, lambda temporary: temporary.write_text(self.markdown(), encoding="utf-8"))

    def markdown(self) -> str:
        """The tables in Markdown: all programs over all clouds, and each program by variant.

        Returns
        -------
        str
        """
        part = "" if self.whole or self.benchmark.startswith(f"{OWN} ") else ", not all of it, or other shapes"
        parts = [f"Benchmark {self.benchmark}{part}. {_CAPTION}"]
        if self.entries:
            first = self.entries[0]["all"]
            title = f"{first['clouds']} clouds of {first['shapes']} shapes"
            known = [name for name in _COLUMNS if name not in OF_THINGS or any(it["all"][name] for it in self.entries)]
            parts.append(_table(title, "program", ((each["name"], each["all"]) for each in self.entries), known))
            parts += [_table(each["name"], "variant", each["variants"].items(), known) for each in self.entries]
        return "\n\n".join(parts) + "\n"


def leaderboard(results: Iterable[Results]) -> Leaderboard:
    """Means with intervals of the results of several programs, the best first: by `perfect`, and then by `topology`.

    Shapes are drawn anew, each with all its clouds, since clouds of one shape are no independent evidence.

    Parameters
    ----------
    results : iterable of Results
        Of the same clouds, with different names.

    Returns
    -------
    Leaderboard

    Raises
    ------
    InvalidParameterError
        They are of different clouds, or two have the same name, or there are none.

    Examples
    --------
    >>> from glsk_bench import Results
    >>> from glsk_bench.scoring import Scores
    >>> rows = [dict(shape="tubes_100", variant="clean", seconds=None, **Scores.of_failure("no answer").as_dict())]
    >>> leaderboard([Results("v1", "mine", False, rows)]).entries[0]["all"]["failures"]
    1
    """
    found = list(results)
    if not found or not found[0].rows:
        raise InvalidParameterError("there are no scores to make a table of")
    first = found[0]
    clouds = [{(row["shape"], row["variant"]) for row in each.rows} for each in found]
    for each, those in zip(found, clouds, strict=True):
        if each.benchmark != first.benchmark or those != clouds[0]:
            raise InvalidParameterError(
                f"{each.name!r} and {first.name!r} were scored on different clouds: make one benchmark for both"
            )
    names = [each.name for each in found]
    for name in names:
        if names.count(name) > 1:
            raise InvalidParameterError(f"two programs are called {name!r}: score one with another name")
    entries: list[dict[str, Any]] = []
    for each in found:
        groups: dict[str, list] = {}  # in the order in which they come
        for row in each.rows:
            groups.setdefault(row["variant"], []).append(row)
        by_variant = {variant: _cell(rows) for variant, rows in groups.items()}
        entries.append({"name": each.name, "all": _cell(each.rows), "variants": by_variant})
    entries.sort(key=lambda entry: [-entry["all"][measure][0] for measure in ("perfect", "topology")])
    return Leaderboard(first.benchmark, first.whole, entries)


def _cell(rows: Sequence[dict[str, Any]]) -> Cell:
    cell: Cell = {"clouds": len(rows), "shapes": len({row["shape"] for row in rows})}
    cell["failures"] = sum(row["failure"] is not None for row in rows)
    for measure in MEASURES:
        known = [row for row in rows if row[measure] is not None]
        found = mean_with_interval([row["shape"] for row in known], [row[measure] for row in known])
        cell[measure] = list(found) if known else None
    seconds = [row["seconds"] for row in rows if row["seconds"] is not None and row["failure"] is None]
    cell["seconds"] = median(seconds) if seconds else None
    return cell


def _table(title: str, first: str, cells: Iterable[tuple[str, Cell]], measures: Sequence[str]) -> str:
    """A table in Markdown."""
    heads = [first, "clouds", "failures", *(_HEADS.get(measure, measure) for measure in measures), "s"]
    lines = []
    for name, cell in cells:
        means = []
        for measure in measures:
            mean, low, high = cell[measure] or (np.nan, np.nan, np.nan)
            means.append(told(mean, low, high, _DIGITS.get(measure, 2)))
        seconds = "-" if cell["seconds"] is None else f"{cell['seconds']:.2f}"
        lines.append([name, str(cell["clouds"]), str(cell["failures"]), *means, seconds])
    return markdown_lines(title, heads, lines)


def markdown_lines(title: str, heads: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """A table in Markdown, of words: no name breaks it."""
    rows = [heads, ["---", *["--:"] * (len(heads) - 1)], *([_plain(word) for word in words] for words in lines)]
    return "\n".join([f"**{_plain(title)}**", "", *(f"| {' | '.join(words)} |" for words in rows)])


def _plain(name: str) -> str:
    return " ".join(name.split()).replace("|", "\\|")
