"""Whether people would take the skeletons: a sheet of pictures, and how far two raters of it agree."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from glsk_o3d import plot_skeleton, read_cloud
from glsk_o3d.errors import FileFormatError, InvalidParameterError
from glsk_o3d.interop.atomic import write_atomically
from glsk_o3d.interop.clouds import cloud_points
from glsk_o3d.parameters import check_number
from glsk_o3d.viewing.figures import new_figure, save_figure

from .folders import BenchmarkFolder
from .scoring import Answers

ANSWERS = ("accept", "edit", "reject")
"""What a rater says of a skeleton: to be used as it is, after one edit, or not."""
VIEWS = ((15.0, -65.0), (15.0, 25.0))  # fitted: elevation and azimuth of a skeleton's two pictures [degrees]
ACROSS = 4  # fitted: skeletons in a row of a sheet, as a screen is wide
SIDE = 2.2  # fitted: of a picture [inches], so that short limbs show
MOST = 100  # fitted: skeletons, so that pictures can still be opened
HEAD = ("number", "cloud", "answer")  # of a rater's table


def draw_sheet(
    folder: BenchmarkFolder | str | os.PathLike,
    answers: str | os.PathLike,
    path: str | os.PathLike,
    *,
    n: int = 24,
    seed: int = 0,
) -> list[str]:
    """Draw skeletons for raters: clouds taken at random, each from two sides, numbered.

    Beside the picture a table of the same name with the ending ``.csv`` has a row for each, without an answer.

    Parameters
    ----------
    folder : BenchmarkFolder or path-like
    answers : path-like
        As for `score_answers`. A cloud without an answer is drawn alone, for it is to be rejected.
    path : path-like
        Of a PNG.
    n : int
        Skeletons, at most 100, and all scored clouds.
    seed : int
        0 or more; the same seed takes the same clouds, whichever program answered.

    Returns
    -------
    list of str
        The clouds, in the order of their numbers.

    Raises
    ------
    FileNotFoundError
        There is no such folder.
    FileFormatError
        As `score_answers`.
    InvalidParameterError
        A number is out of its range.
    MissingPackageError
        Matplotlib is not installed.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import save_skeleton, skeletonize
    >>> from glsk_bench import make
    >>> with TemporaryDirectory() as place:
    ...     made = make(f"{place}/bench", families=["tubes"], seeds=[100], variants=["clean"], jobs=1)
    ...     Path(place, "mine").mkdir()
    ...     save_skeleton(skeletonize(read_cloud(made.clouds[0].path)), f"{place}/mine/tubes_100_clean.obj")
    ...     draw_sheet(made, f"{place}/mine", f"{place}/sheet.png")
    ...     Path(place, "sheet.csv").read_text()
    ['tubes_100_clean']
    'number,cloud,answer\\n1,tubes_100_clean,\\n'
    """
    check_number("n", n, "int", low=1, high=MOST)
    check_number("seed", seed, "int", low=0)
    given = Answers(folder, answers)
    clouds = given.made.scored
    taken = [clouds[i] for i in np.random.default_rng(seed).permutation(len(clouds))[:n]]
    across = min(len(taken), ACROSS)
    down = -(-len(taken) // across)
    figure = new_figure((2 * SIDE * across, (SIDE + 0.2) * down), layout="constrained")
    for number, cloud in enumerate(taken, 1):
        points = cloud_points(read_cloud(cloud.path))
        found = given.use(cloud, lambda skeleton: skeleton)
        for side, view in enumerate(VIEWS):
            axes = figure.add_subplot(down, 2 * across, 2 * number - 1 + side, projection="3d")
            plot_skeleton(None if isinstance(found, str) else found, axes, cloud=points, view=view)
            if side == 0:
                axes.set_title(f"{number}: no answer" if isinstance(found, str) else f"{number}", fontsize=9)
    lines = [HEAD, *((str(number), cloud.name, "") for number, cloud in enumerate(taken, 1))]
    text = "".join(",".join(line) + "\n" for line in lines)
    save_figure(figure, path)
    write_atomically(Path(path).with_suffix(".csv"), lambda temporary: temporary.write_text(text, encoding="utf-8"))
    return [cloud.name for cloud in taken]


def rates(first: str | os.PathLike, second: str | os.PathLike) -> dict[str, Any]:
    """What two raters of a sheet say, and how far they agree.

    Parameters
    ----------
    first, second : path-like
        The sheet's table, each filled in by a rater alone: in the column ``answer`` accept, edit or reject.

    Returns
    -------
    dict
        How many ``clouds``; the share of each answer by each rater, such as ``accept``, a list of two; ``both``, the
        share that both accept; ``agree``, the share of equal answers; and `kappa`.

    Raises
    ------
    FileNotFoundError
    FileFormatError
        A file is no such table, or an answer is missing.
    InvalidParameterError
        The tables have different clouds.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     for name, answer in (("a", "accept"), ("b", "edit")):
    ...         _ = Path(place, f"{name}.csv").write_text(f"number,cloud,answer\\n1,x,accept\\n2,y,{answer}\\n")
    ...     found = rates(f"{place}/a.csv", f"{place}/b.csv")
    >>> found["accept"], found["agree"], found["kappa"]
    ([1.0, 0.5], 0.5, 0.0)
    """
    tables = [_read(Path(path)) for path in (first, second)]
    if tables[0].keys() != tables[1].keys():
        raise InvalidParameterError(f"{first} and {second} have different clouds: two raters take the same sheet")
    said = np.array([[table[name] for name in tables[0]] for table in tables])
    return {
        "clouds": said.shape[1],
        **{answer: (said == answer).mean(axis=1).tolist() for answer in ANSWERS},
        "both": float((said == ANSWERS[0]).all(axis=0).mean()),
        "agree": float((said[0] == said[1]).mean()),
        "kappa": kappa(*said),
    }


def kappa(first: Sequence[Any], second: Sequence[Any]) -> float | None:
    """How far two raters agree beyond chance (Cohen 1960): 1 always, 0 as by chance.

    Parameters
    ----------
    first, second : (n,) sequence
        The answers of each, in the same order.

    Returns
    -------
    float or None
        None where both always give one and the same answer, so that chance says all.

    Raises
    ------
    InvalidParameterError
        There are none, or not as many of both.

    Examples
    --------
    >>> kappa(["accept", "accept", "reject", "reject"], ["accept", "reject", "reject", "reject"])
    0.5
    """
    if len(first) != len(second) or not len(first):
        raise InvalidParameterError(f"each must have given as many answers, not {len(first)} and {len(second)}")
    known, codes = np.unique([*first, *second], return_inverse=True)
    counts = np.zeros((len(known), len(known)))
    np.add.at(counts, tuple(codes.reshape(2, -1)), 1 / len(first))
    agree, chance = np.trace(counts), counts.sum(axis=0) @ counts.sum(axis=1)
    return None if len(known) == 1 else float((agree - chance) / (1 - chance))


def _read(path: Path) -> dict[str, str]:
    """The answers of a rater, by cloud."""
    with path.open(newline="", encoding="utf-8-sig") as stream:
        try:
            rows = [*csv.DictReader(stream)]
        except (csv.Error, UnicodeDecodeError) as error:
            raise FileFormatError(f"{path}: not a table: {error}") from None
    if not rows or not {"cloud", "answer"} <= rows[0].keys():
        raise FileFormatError(f"{path}: not the table of a sheet: it begins with {','.join(HEAD)}")
    found = {row["cloud"]: (row["answer"] or "").strip().lower() for row in rows}
    wrong = [name for name, answer in found.items() if answer not in ANSWERS]
    if wrong or len(found) < len(rows):
        what = f"the answer to {wrong[0]} is none of {', '.join(ANSWERS)}" if wrong else "a cloud is there twice"
        raise FileFormatError(f"{path}: {what}")
    return found
