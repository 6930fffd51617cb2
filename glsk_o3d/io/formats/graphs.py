"""What the formats of skeletons have in common: graphs that are checked, trees with a root, lines of text."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import ArrayLike

from ...analysis.branches import branch_table
from ...analysis.curves import simple_edges
from ...curve.rooted import RootPlace, numbered_from
from ...data.skeleton import Skeleton
from ...editing import cut_loops, reroot
from ...errors import FileFormatError

FLOAT32_SHARE = 0.01  # derived: an error of a hundredth of a radius is below what any fit of the axis knows


class NoEdges(Exception):
    """A file in a format that clouds have too holds no edges, and was not written as a skeleton."""


def graph_skeleton(
    vertices: ArrayLike, edges: ArrayLike, radii: ArrayLike | None = None, **others: ArrayLike
) -> Skeleton:
    """A skeleton without a cloud, of edges in any order: they are sorted, and repeated ones and those from a vertex to
    itself are dropped. `others` are other fields of the vertices.
    """
    vertices = np.asarray(vertices, float).reshape(-1, 3)
    edges, none = simple_edges(np.asarray(edges, np.int64).reshape(-1, 2)), np.empty(0)
    return Skeleton(vertices, edges, radii, vertex_of_point=none, points=none, normals=none, **others)  # type: ignore[arg-type]


def as_forest(skeleton: Skeleton, cut: bool, root: RootPlace | None) -> Skeleton:
    """A skeleton as one tree per component, numbered from the roots outwards: every other vertex has one neighbour of
    lower number. Loops are cut if `cut`, else FileFormatError; `root` is as for `save_skeleton`.
    """
    if skeleton.n_loops and not cut:
        raise FileFormatError(
            f"this format holds trees only and the skeleton has {skeleton.n_loops} loop(s): "
            "pass cut_loops=True (--cut-loops) to drop an edge of each, or choose another format"
        )
    forest = cut_loops(skeleton)[0] if skeleton.n_loops else skeleton
    if len(forest.vertices) == 0:
        return forest
    if root is not None:
        return reroot(forest, root)
    if len(np.unique(forest.edges[:, 1])) == len(forest.edges):  # no vertex has two neighbours of lower number
        return forest
    table = branch_table(forest)
    return numbered_from(forest, int(table.start[np.argmin(table.level)]))


@contextmanager
def holding_all(path: object) -> Iterator[None]:
    """FileFormatError where a number grows larger than the format of a file holds: glTF has float32."""
    try:
        with np.errstate(over="raise"):
            yield
    except FloatingPointError:
        raise FileFormatError(
            f"{path}: its format does not hold numbers as large as these: rescale the skeleton"
        ) from None


def parents(forest: Skeleton) -> np.ndarray:
    """The vertex before each of a forest that is numbered outwards, (M,) int array; -1 for roots."""
    parent = np.full(len(forest.vertices), -1)
    parent[forest.edges[:, 1]] = forest.edges[:, 0]
    return parent


def global_shift(skeleton: Skeleton) -> np.ndarray:
    """What to take off coordinates so that float32 holds them, (3,) float array of whole numbers; 0 along axes where
    float32 holds them as they are.
    """
    vertices = skeleton.vertices
    sizes = np.concatenate([skeleton.radii, skeleton.edge_lengths])
    sizes = sizes[sizes > 0]
    if len(sizes) == 0:
        return np.zeros(3)
    inexact = np.abs(vertices).max(axis=0) * np.finfo(np.float32).eps > FLOAT32_SHARE * np.median(sizes)
    return np.where(inexact, np.floor(vertices.min(axis=0)), 0.0)


def line(*words: object) -> str:
    """Words and numbers with spaces between them; floats keep their full precision."""
    return " ".join(map(str, words))  # str of a float is its shortest exact form


def text(lines: Iterable[str]) -> bytes:
    """Lines as the content of a file."""
    return ("\n".join(lines) + "\n").encode()


def words_by_line(data: bytes) -> list[list[str]]:
    """The words of every line that has some, comments left out."""
    lines = (line.partition("#")[0].split() for line in data.decode("utf-8", "replace").splitlines())
    return [words for words in lines if words]
