"""How far skeletons of several clouds of one object are apart: what of a skeleton is chance."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import fmean, median
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from glsk_o3d.analysis.comparison import PLACE_SPACING
from glsk_o3d.analysis.curves import places_along, simple_edges
from glsk_o3d.analysis.summary import structure
from glsk_o3d.data.skeleton import Skeleton
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.interop.atomic import write_json

from .folders import BenchmarkFolder, CloudFile
from .measures import HOOK_ANGLE, last_turns
from .scoring import Answers, check_size
from .table import markdown_lines

PLACES = ("ends", "junctions", "elsewhere", "limbs")
"""Where skeletons are apart: near ends, near junctions, elsewhere; and limbs that the other does not have."""
NEAR_PLACE = 2.0  # fitted: radii around an end or a junction, and from the other skeleton where that has no such limb
DOUBLE, SINGLE = "float64", "0"
"""The variants of an object that are one cloud: in float64, and as it is written otherwise, in float32."""
_SHARES = ("agree", "loops", "ends")
_KNOWN = ("components", "loops", "ends")


def spread(
    skeletons: Sequence[Skeleton | None],
    radius: float,
    *,
    components: int = 1,
    loops: int | None = None,
    ends: Sequence[int] | None = None,
) -> dict[str, Any]:
    """How far skeletons of several clouds of one object are apart.

    Parameters
    ----------
    skeletons : sequence of Skeleton or None
        None where a program has found none, or one without vertices: it agrees with no other, and has no right loops
        and ends.
    radius : float
        Of the object, by which distances are divided: the same for all programs that are compared.
    components, loops : int, optional
        The right ones, if they are known.
    ends : (2,) sequence of int, optional
        The least and the largest number of ends that is right.

    Returns
    -------
    dict
        ``moved``, the mean distance of one skeleton from another, in radii, over all pairs and both ways, None for
        fewer than two; ``where``, its parts by `PLACES`; ``agree``, the share of all clouds with the commonest
        components, loops and leaves; ``loops`` and ``ends``, the shares in which these are right, or None; ``tips``,
        how many ends of branches longer than 3.5 radii there are, and ``hooks``, how many of these turn by more than
        30 degrees in their last radius; ``found``, the components, loops and leaves of each; ``failures``.

    Raises
    ------
    InvalidParameterError
        There are no skeletons, one is too long, or the radius is not positive.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(500)
    >>> one = Skeleton(ring.nodes, ring.edges, ring.radii, (), (), ())
    >>> other = Skeleton(ring.nodes + [0, 0, 0.1], ring.edges, ring.radii, (), (), ())
    >>> found = spread([one, other], 0.2, loops=1)
    >>> round(found["moved"], 3), found["agree"], found["loops"]
    (0.5, 1.0, 1.0)
    """
    if len(skeletons) == 0 or not 0 < radius < np.inf:
        raise InvalidParameterError(f"there must be skeletons, and a positive radius, not {len(skeletons)}, {radius:g}")
    there = [each for each in skeletons if each is not None and len(each.vertices)]
    facts = [(each.n_components, each.n_loops, len(each.leaves)) for each in there]
    moved, where = _moves(there, radius)
    turns = [last_turns(each, each.leaves, np.full(len(each.leaves), radius)) for each in there]
    angles = np.concatenate([*turns, np.empty(0)])
    right = [each[:2] == (components, loops) for each in facts]
    return {
        "moved": moved,
        "where": where,
        "agree": max(map(facts.count, facts), default=0) / len(skeletons),
        "loops": None if loops is None else sum(right) / len(skeletons),
        "ends": None if ends is None else sum(ends[0] <= n <= ends[1] for *_, n in facts) / len(skeletons),
        "hooks": int((angles > HOOK_ANGLE).sum()),
        "tips": int(np.isfinite(angles).sum()),
        "found": [list(each) for each in facts],
        "failures": len(skeletons) - len(there),
    }


def _moves(skeletons: Sequence[Skeleton], radius: float) -> tuple[float | None, dict[str, float] | None]:
    """The mean distance of each skeleton from each other, and what each of the `PLACES` adds to it."""
    curves = [places_along(each, PLACE_SPACING * radius)[1] for each in skeletons]
    trees, moved, where = [cKDTree(curve) for curve in curves], [], np.zeros(len(PLACES))
    for one, (skeleton, curve) in enumerate(zip(skeletons, curves, strict=True)):
        at_end, at_junction = (
            cKDTree(skeleton.vertices[some]).query(curve)[0] < NEAR_PLACE * radius
            if len(some)
            else np.zeros(len(curve), bool)
            for some in (skeleton.leaves, skeleton.junctions)
        )
        for tree in trees[:one] + trees[one + 1 :]:
            away = tree.query(curve)[0] / radius
            place = np.select([away > NEAR_PLACE, at_end, at_junction], [3, 0, 1], 2)
            where += np.bincount(place, away, len(PLACES)) / len(away)
            moved.append(float(away.mean()))
    if not moved:
        return None, None
    return fmean(moved), dict(zip(PLACES, (where / len(moved)).tolist(), strict=True))


@dataclass(frozen=True)
class Repeat:
    """How far a program's answers to several clouds of each object are apart.

    Attributes
    ----------
    benchmark : str
        As of `Results`.
    name : str
        Of the program.
    rows : list of dict
        For each object its name as ``object``, its ``radius`` and how many ``draws`` there are, and what `spread` says.
        ``float32`` is None, or of one cloud in float64 and in float32: ``moved``, and ``agree``, whether both skeletons
        have the same components, loops and leaves.

    Examples
    --------
    >>> Repeat("own 00000000", "mine", []).means()["objects"]
    0
    """

    benchmark: str
    name: str
    rows: list[dict[str, Any]]

    def means(self) -> dict[str, Any]:
        """All objects together.

        Returns
        -------
        dict
            How many ``objects``, ``draws`` and ``failures``; the mean and the ``median`` of ``moved``; the means of the
            shares, and of ``where``; the share of ``hooks`` of all ends that are long enough; and of ``float32`` the
            mean of ``moved`` and the share that does ``agree``. None where nothing is known.
        """
        moved = [row["moved"] for row in self.rows if row["moved"] is not None]
        where = [row["where"] for row in self.rows if row["where"] is not None]
        shares = {name: [row[name] for row in self.rows if row[name] is not None] for name in _SHARES}
        tips = sum(row["tips"] for row in self.rows)
        return {
            "objects": len(self.rows),
            **{name: sum(row[name] for row in self.rows) for name in ("draws", "failures")},
            "moved": fmean(moved) if moved else None,
            "median": median(moved) if moved else None,
            **{name: fmean(values) if values else None for name, values in shares.items()},
            "hooks": sum(row["hooks"] for row in self.rows) / tips if tips else None,
            "where": {name: fmean(each[name] for each in where) for name in PLACES} if where else None,
            "float32": self._float32(),
        }

    def _float32(self) -> dict[str, float | None] | None:
        """The means over all objects with a cloud in float64."""
        pairs = [row["float32"] for row in self.rows if row.get("float32")]
        if not pairs:
            return None
        moved = [each["moved"] for each in pairs if each["moved"] is not None]
        return {"moved": fmean(moved) if moved else None, "agree": fmean(each["agree"] for each in pairs)}

    def as_dict(self) -> dict[str, Any]:
        """All of it, as JSON holds it.

        Returns
        -------
        dict
        """
        return {"benchmark": self.benchmark, "name": self.name, "means": self.means(), "objects": self.rows}

    def save(self, path: str | os.PathLike) -> None:
        """Write `as_dict` as JSON.

        Parameters
        ----------
        path : path-like
        """
        write_json(path, self.as_dict())

    def markdown(self) -> str:
        """A table in Markdown: a row for each object, and the means.

        Returns
        -------
        str
        """
        heads = ["object", "moved", "near ends", "near junctions", "elsewhere", "limbs"]
        heads += ["agree", "right loops", "right ends", "hooks", "failures"]
        lines, means = [], self.means()
        double = means["float32"] is not None
        heads += ["float32 moved", "float32 agrees"] if double else []
        for row in self.rows:
            hooks = f"{row['hooks']} of {row['tips']}"
            cells = [row["object"], *_cells(row), hooks, f"{row['failures']} of {row['draws']}"]
            lines.append(cells + (_pair(row.get("float32")) if double else []))
        cells = ["mean", *_cells(means), _number(means["hooks"]), f"{means['failures']} of {means['draws']}"]
        lines.append(cells + (_pair(means["float32"]) if double else []))
        return markdown_lines(f"{self.name}: answers to several clouds of each object", heads, lines) + "\n"


def _cells(row: dict[str, Any]) -> list[str]:
    where = row["where"] or dict.fromkeys(PLACES)
    return list(map(_number, [row["moved"], *where.values(), *(row[name] for name in _SHARES)]))


def _pair(found: dict[str, Any] | None) -> list[str]:
    return [_number(found[name] if found else None) for name in ("moved", "agree")]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def repeat(
    folder: BenchmarkFolder | str | os.PathLike,
    answers: str | os.PathLike,
    *,
    name: str | None = None,
    on_object: Callable[[str, int, int], object] | None = None,
) -> Repeat:
    """Compare a program's answers to several clouds of each object with each other.

    Parameters
    ----------
    folder : BenchmarkFolder or path-like
        With several clouds of each object, as `sample` makes them; or any other, whose variants are then compared. A
        cloud in float64 is compared with the first one alone.
    answers : path-like
        As for `score_answers`. What is missing or unreadable counts as a failure.
    name : str, optional
        Of the program; by default that of the folder of answers.
    on_object : callable, optional
        Called with the name of each object that is done, how many are, and of how many.

    Returns
    -------
    Repeat

    Raises
    ------
    FileNotFoundError
        There is no such folder.
    FileFormatError
        The benchmark is damaged, a cloud has two answers, or the folder of answers has none at all.
    InvalidParameterError
        An object has one cloud only.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import save_skeleton
    >>> from glsk_bench import make
    >>> with TemporaryDirectory() as place:
    ...     made = make(f"{place}/bench", families=["tubes"], seeds=[100], variants=["clean", "noise1"], jobs=1)
    ...     axis = made.truth("tubes_100")
    ...     Path(place, "mine").mkdir()
    ...     for variant in ("clean", "noise1"):
    ...         found = Skeleton(axis.nodes, axis.edges, axis.radii, (), (), ())
    ...         save_skeleton(found, f"{place}/mine/tubes_100_{variant}.obj")
    ...     means = repeat(made, f"{place}/mine").means()
    >>> means["moved"], means["agree"], means["loops"]
    (0.0, 1.0, 1.0)
    """
    given = Answers(folder, answers)
    objects: dict[str, list[CloudFile]] = {}
    for cloud in given.made.scored:
        objects.setdefault(cloud.shape, []).append(cloud)
    if alone := [shape for shape, clouds in objects.items() if len(clouds) < 2]:
        raise InvalidParameterError(
            f"{given.made.path}: has one cloud of {alone[0]}, with nothing to compare: 'glsk benchmark sample' draws "
            "several of each object"
        )
    rows = []
    for done, (shape, clouds) in enumerate(objects.items(), 1):
        radius, known = _known(given.made, shape)

        def checked(answer: Skeleton, radius: float = radius) -> Skeleton:
            check_size(radius, answer.vertices, answer.edges)
            return answer

        found = {cloud.variant: given.use(cloud, checked) for cloud in clouds}
        skeletons = {variant: None if isinstance(each, str) else each for variant, each in found.items()}
        draws = [each for variant, each in skeletons.items() if variant != DOUBLE]
        row = {"object": shape, "draws": len(draws), "radius": radius, **spread(draws, radius, **known)}
        row["float32"] = _float32(skeletons, radius)
        rows.append(row)
        if on_object is not None:
            on_object(shape, done, len(objects))
    return Repeat(given.made.name, name or given.name, rows)


def _float32(skeletons: dict[str, Skeleton | None], radius: float) -> dict[str, Any] | None:
    """How far the skeletons of one cloud in float64 and in float32 are apart, and whether they have the same graph."""
    if not {DOUBLE, SINGLE} <= skeletons.keys():
        return None
    found = spread([skeletons[DOUBLE], skeletons[SINGLE]], radius)
    return {"moved": found["moved"], "agree": found["agree"] == 1}


def _known(made: BenchmarkFolder, shape: str) -> tuple[float, dict[str, Any]]:
    """The radius of an object, and the right components, loops and ends: as they were given, or of its axis."""
    told = made.shapes[shape]
    if "radius" in told:
        return float(told["radius"]), {name: told[name] for name in _KNOWN}
    return of_axis(made.truth(shape))


def of_axis(truth: Any) -> tuple[float, dict[str, Any]]:
    """The same, of a true axis: ends are not known where not all of it is judged."""
    axis = Skeleton(truth.nodes, simple_edges(truth.edges), truth.radii, (), (), ())  # type: ignore[arg-type]
    counts = structure(axis)
    judged = np.asarray(getattr(truth, "judged", True))
    ends = [counts["leaves"]] * 2 if judged.all() else None
    return float(np.median(truth.radii)), {"components": counts["components"], "loops": counts["loops"], "ends": ends}
