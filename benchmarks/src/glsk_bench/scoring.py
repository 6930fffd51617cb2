"""Scores of skeletons against the true axes of shapes, and of folders of them."""

from __future__ import annotations

import gzip
import json
import os
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from glsk_o3d.analysis.comparison import PLACE_SPACING, Truth, compare
from glsk_o3d.analysis.curves import check_graph, simple_edges
from glsk_o3d.data.skeleton import Skeleton
from glsk_o3d.errors import FileFormatError, InvalidParameterError, MissingPackageError, brief
from glsk_o3d.interop.atomic import write_json
from glsk_o3d.io.skeletons import READABLE, read_skeleton

from .folders import BenchmarkFolder, CloudFile, read_folder
from .measures import of_thing
from .truths import THING_ARRAYS, ThingTruth

T = TypeVar("T")
# Where an answer is refused, so that no program can fill the memory of who scores it.
MOST_ANSWER_PLACES = 2_000_000  # fitted: along an answer; axes of the benchmark have a thousand to ten thousand
MOST_ANSWER_JUNCTIONS = 5000  # fitted: of which all pairs are compared; axes have up to some twenty


@dataclass(frozen=True)
class Scores:
    """What an answer to one cloud is worth.

    The measures are those of `glsk_o3d.analysis.compare`, in radii of the true axis.

    Attributes
    ----------
    perfect : bool
        Components and loops are right, and every leaf is matched.
    topology : bool
        Components and loops are right.
    tips_f1, junctions_f1 : float
        F1 of the leaves, and of the junctions. 0 to 1, 1 is best.
    error : float or None
        Mean distance of the answer from the axis. 0 is best.
    inside, completeness : float or None
        Share of the answer that is less than a radius away from the axis, and of the axis from the answer. 1 is best.
    length : float or None
        Length of the answer over that of the axis. 1 is best. None if the axis has no length.
    ends : float or None
        Mean distance from the leaves of the axis to the nearest leaf of the answer. 0 is best. None if there
        are none.
    components, loops, leaves, junctions : int or None
        How many more the answer has than the axis.
    hooks : float or None
        Share of the answer's ends, of branches longer than 3.5 radii, whose last radius turns by more than 30 degrees
        against the run from 1.5 to 3.5 radii behind the tip, beyond what the true end turns. 0 is best.
    reach, overshoot : float or None
        How far along the axis the answer ends from where it should at a flat face, half a radius inside: the mean
        without and with the sign, of which + is too far. 4 radii where none of it comes near. 0 is best.
    wiggle : float or None
        Length of the answer over that of the axis, less 1, where each runs beside the other. 0 is best.
    mirror : float or None
        Mean distance of the answer from its mirror image, of what has a plane of symmetry. 0 is best.
    junction_offset : float or None
        Mean distance of the junctions that are paired with true ones. 0 is best.
    failure : str or None
        Why there is no answer that could be scored. Then `perfect` and `topology` are false, both F1 are 0, and all
        others are None.

    Notes
    -----
    From `hooks` to `junction_offset` they are None unless the truth is that of a thing, as of version 2. Where edges of
    it are not judged, all is measured on the judged ones and on what of the answer is nearest to these, `topology`
    excepted; then `junctions_f1`, `length`, `junctions` and `junction_offset` are None.

    Examples
    --------
    >>> Scores.of_failure("no answer").topology
    False
    """

    perfect: bool
    topology: bool
    tips_f1: float
    junctions_f1: float | None
    error: float | None = None
    inside: float | None = None
    completeness: float | None = None
    length: float | None = None
    ends: float | None = None
    components: int | None = None
    loops: int | None = None
    leaves: int | None = None
    junctions: int | None = None
    hooks: float | None = None
    reach: float | None = None
    overshoot: float | None = None
    wiggle: float | None = None
    mirror: float | None = None
    junction_offset: float | None = None
    failure: str | None = None

    @classmethod
    def of_failure(cls, reason: str) -> Scores:
        """The scores of an answer that is missing, or that is no skeleton.

        Parameters
        ----------
        reason : str

        Returns
        -------
        Scores
        """
        return cls(perfect=False, topology=False, tips_f1=0.0, junctions_f1=0.0, failure=reason)

    def as_dict(self) -> dict[str, Any]:
        """The scores, as JSON holds them.

        Returns
        -------
        dict of str to float, int, bool, str or None
        """
        return asdict(self)


def score(truth: Any, vertices: Any, edges: Any) -> Scores:
    """Score a skeleton against the true axis of a shape. Needs NumPy and SciPy alone.

    Parameters
    ----------
    truth : Truth, Sample, or anything else with `nodes`, `edges` and `radii`
        Of a thing it also has `half_width`, `flat`, `judged` and `mirror`, as `BenchmarkFolder.truth` gives them.
    vertices : (M, 3) array_like of float
        In the units of the truth.
    edges : (E, 2) array_like of int
        Pairs of vertices, in any order.

    Returns
    -------
    Scores

    Raises
    ------
    InvalidParameterError
        The skeleton is empty, or not finite, or no graph; or it is so much longer than the axis, or so much of a mesh,
        that it can be no answer.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(500)
    >>> score(ring, ring.nodes, ring.edges).perfect
    True
    >>> score(ring, ring.nodes, ring.edges[1:]).loops
    -1
    """
    axis = _truth(truth)
    try:
        places = np.asarray(vertices, float).reshape(-1, 3)
        links = simple_edges(check_graph(places, edges, "skeleton"))
    except (TypeError, ValueError) as error:
        if isinstance(error, InvalidParameterError):
            raise
        raise InvalidParameterError(f"the skeleton has invalid vertices or edges: {error}") from None
    check_size(float(np.median(axis.radii)), places, links)
    answer = Skeleton(places, links, (), (), (), ())  # type: ignore[arg-type]
    found = asdict(compare(answer, axis))
    if isinstance(axis, ThingTruth):
        found |= of_thing(axis, answer, found["topology"])
    return Scores(**{name: found[name] for name in Scores.__dataclass_fields__ if name in found})


def _truth(truth: Any) -> Truth:
    """The truth as its class, if it is something else that has what it has."""
    if isinstance(truth, Truth):
        return truth
    parts = (truth.nodes, truth.edges, truth.radii)
    if not all(hasattr(truth, name) for name in THING_ARRAYS):
        return Truth(*parts)
    return ThingTruth(*parts, *(getattr(truth, name) for name in THING_ARRAYS))


def check_size(radius: float, vertices: np.ndarray, edges: np.ndarray) -> None:
    """Raise InvalidParameterError for what would take too much memory to score, with places by the median radius."""
    with np.errstate(over="ignore"):
        length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1).sum()
    places = length / (PLACE_SPACING * radius) + len(edges) + len(vertices)
    if not places <= MOST_ANSWER_PLACES:
        raise InvalidParameterError(
            f"the skeleton is {length:.3g} long and has {len(edges)} edges, too much for an answer: is it in the units "
            "of the cloud?"
        )
    junctions = int((np.bincount(edges.ravel(), minlength=1) > 2).sum())
    if junctions > MOST_ANSWER_JUNCTIONS:
        raise InvalidParameterError(
            f"the skeleton has {junctions} junctions, more than {MOST_ANSWER_JUNCTIONS}: is it a mesh?"
        )


OF_THINGS = ("hooks", "reach", "overshoot", "wiggle", "mirror", "junction_offset")
"""The measures that only things have."""
MEASURES = (
    *("perfect", "topology", "tips_f1", "junctions_f1", "error", "inside", "completeness", "length", "ends"),
    *OF_THINGS,
)
"""What is averaged: shares and F1 over all clouds, what comes after them over the answers that could be scored."""
TIMES_NAME = "times.json"
MOST_RESULTS = 1 << 28  # derived: bytes, far more than any version has, so that a few bytes cannot fill the memory
_FACTS = ("benchmark", "name", "whole", "clouds")
_PARTS = ("seconds", "failure", "digits")
_BROKEN = (EOFError, zlib.error, gzip.BadGzipFile)  # what is not packed as it should be


@dataclass(frozen=True)
class Results:
    """The scores of a program's answers to all clouds of a benchmark.

    Attributes
    ----------
    benchmark : str
        The version; of somebody's own clouds "own" and digits that differ where clouds or axes do.
    name : str
        Of the program, as the table shows it.
    whole : bool
        Whether the benchmark has all shapes and variants of the version, and no others.
    rows : list of dict
        For each cloud that is scored its shape, family, variant, `Scores`, and the seconds if they were measured.

    Examples
    --------
    >>> Results("v1", "mine", True, []).failures
    0
    """

    benchmark: str
    name: str
    whole: bool
    rows: list[dict[str, Any]]

    @property
    def failures(self) -> int:
        """Clouds without an answer that could be scored."""
        return sum(row["failure"] is not None for row in self.rows)

    def save(self, path: str | os.PathLike) -> None:
        """Write them as JSON, which `read_results` reads.

        Parameters
        ----------
        path : path-like
        """
        facts = (self.benchmark, self.name, self.whole, self.rows)
        write_json(path, dict(zip(_FACTS, facts, strict=True)))


def score_answers(
    folder: BenchmarkFolder | str | os.PathLike,
    answers: str | os.PathLike,
    *,
    name: str | None = None,
    on_cloud: Callable[[str, int, int], object] | None = None,
) -> Results:
    """Score the answers in a folder.

    An answer to the cloud SHAPE_VARIANT.ply is a skeleton in a file SHAPE_VARIANT with any ending that `read_skeleton`
    reads. A cloud without an answer, or with one that is empty, unreadable or no skeleton, counts as a failure: see
    `Scores`.

    Parameters
    ----------
    folder : BenchmarkFolder or path-like
    answers : path-like
    name : str, optional
        Of the program; by default that of the folder of answers.
    on_cloud : callable, optional
        Called with the name of each cloud that is scored, how many are, and of how many.

    Returns
    -------
    Results

    Raises
    ------
    FileNotFoundError
        There is no such folder.
    FileFormatError
        The benchmark is damaged, a cloud has two answers, or the folder of answers has none at all.

    Examples
    --------
    >>> from glsk_o3d import Skeleton, save_skeleton
    >>> from glsk_bench import make
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     made = make(f"{place}/bench", families=["tubes"], seeds=[100], variants=["clean", "holes"], jobs=1)
    ...     axis = made.truth("tubes_100")
    ...     found = Skeleton(axis.nodes, axis.edges, axis.radii, (), (), ())
    ...     Path(place, "mine").mkdir()
    ...     save_skeleton(found, f"{place}/mine/tubes_100_clean.obj")
    ...     results = score_answers(made, f"{place}/mine")
    >>> [(row["variant"], row["perfect"], row["failure"]) for row in results.rows]
    [('clean', True, None), ('holes', False, 'no answer')]
    """
    given = Answers(folder, answers)
    made, clouds, rows = given.made, given.made.scored, []
    for shape, told in made.shapes.items():
        if not (made.path / told["truth"]).is_file():
            raise FileNotFoundError(
                f"{made.path}: has no true axis of {shape}: 'glsk benchmark repeat' compares answers with each other"
            )
    for done, cloud in enumerate(clouds, 1):
        scores = _score(given, cloud)
        facts = {"shape": cloud.shape, "family": cloud.family, "variant": cloud.variant}
        rows.append({**facts, **scores.as_dict(), "seconds": given.times.get(cloud.name, {}).get("seconds")})
        if on_cloud is not None:
            on_cloud(cloud.name, done, len(clouds))
    return Results(made.name, name or given.name, made.whole, rows)


class Answers:
    """The answers in a folder to the clouds of a benchmark."""

    def __init__(self, folder: BenchmarkFolder | str | os.PathLike, answers: str | os.PathLike):
        self.made = folder if isinstance(folder, BenchmarkFolder) else read_folder(folder)
        place = Path(answers)
        if not place.is_dir():
            raise FileNotFoundError(f"{place}: no such folder of answers")
        self.name, self.files, self.times = place.resolve().name, answer_files(place), read_times(place)
        clouds = self.made.scored
        if not any(cloud.name in self.files or cloud.name in self.times for cloud in clouds):
            example = f"{clouds[0].name}.ply" if clouds else "SHAPE_VARIANT.ply"
            raise FileFormatError(
                f"{place}: has no answer to any cloud of {self.made.path}: they are called as the clouds are, such as "
                f"{example}"
            )

    def use(self, cloud: CloudFile, make: Callable[[Skeleton], T]) -> T | str:
        """What is made of the answer to a cloud; or in words, why there is none of which it can be made."""
        told, files = self.times.get(cloud.name, {}), self.files.get(cloud.name, [])
        failure = told.get("failure")
        if told.get("digits") not in (None, self.made.digits(cloud)):
            return "no answer: what is there answers another cloud of this name"
        if len(files) > 1:
            raise FileFormatError(f"{files[0]}: {files[1].name} answers the same cloud: keep one of them")
        if not files:
            return f"no answer: {failure}" if failure else "no answer"
        try:
            return make(read_skeleton(files[0]))
        except MissingPackageError:
            raise
        except (FileFormatError, InvalidParameterError, OSError, MemoryError) as error:
            return f"unreadable: {brief(error).removeprefix(f'{files[0]}: ')}"


def answer_files(place: Path) -> dict[str, list[Path]]:
    """The files of a folder with the endings of skeletons, by their names before the ending."""
    found: dict[str, list[Path]] = {}
    for path in sorted(place.iterdir()):
        endings = [ending for ending in READABLE if path.name.lower().endswith(ending)]
        if endings:
            found.setdefault(path.name[: -len(max(endings, key=len))], []).append(path)
    return found


def _score(given: Answers, cloud: CloudFile) -> Scores:
    """The scores of the answer to a cloud: that of a failure if there is none."""
    truth = given.made.truth(cloud.shape)
    found = given.use(cloud, lambda answer: score(truth, answer.vertices, answer.edges))
    if not isinstance(found, str):
        return found
    in_part = isinstance(truth, ThingTruth) and not truth.judged.all()
    scores = Scores.of_failure(found)
    return replace(scores, junctions_f1=None) if in_part else scores  # of an answer it would be None, too


def read_times(place: Path) -> dict[str, dict[str, Any]]:
    """What ``times.json`` says of each cloud, if it is there: seconds, why there is no answer, and `digits`."""
    path = place / TIMES_NAME
    if not path.is_file():
        return {}
    try:
        told = json.loads(path.read_text(encoding="utf-8"))["clouds"]
        return {str(name): {part: each.get(part) for part in _PARTS if part in each} for name, each in told.items()}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        message = f"is damaged ({type(error).__name__}: {error}): remove it, and seconds are not known"
        raise FileFormatError(f"{path}: {message}") from None


def read_results(path: str | os.PathLike) -> Results:
    """What `Results.save` has written.

    Parameters
    ----------
    path : path-like
        Also packed by gzip, if its name ends in ``.gz``.

    Returns
    -------
    Results

    Raises
    ------
    FileNotFoundError
    FileFormatError
        The file holds no scores.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     Results("v1", "mine", True, []).save(f"{folder}/scores.json")
    ...     read_results(f"{folder}/scores.json").name
    'mine'
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as stream:
            data = stream.read(MOST_RESULTS + 1)
        if len(data) > MOST_RESULTS:
            raise ValueError("it is too large")
        told = json.loads(data)
        benchmark, name, whole, rows = (told[fact] for fact in _FACTS)
        known = {"shape", "variant", "seconds", *Scores.__dataclass_fields__} - {*OF_THINGS}
        if not all(isinstance(fact, str) for fact in (benchmark, name)) or any(known - row.keys() for row in rows):
            raise ValueError("a part is missing")
        rows = [dict.fromkeys(OF_THINGS) | row for row in rows]  # which older scores lack
        if not all(isinstance(row[measure], int | float | None) for row in rows for measure in (*MEASURES, "seconds")):
            raise ValueError("a measure is no number")
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, *_BROKEN) as error:
        raise FileFormatError(f"{path}: not the scores of a benchmark ({type(error).__name__}: {error})") from None
    return Results(benchmark, name, bool(whole), rows)
