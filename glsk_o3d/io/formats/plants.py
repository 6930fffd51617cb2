"""SWC, MTG and the node lists of TomatoWUR: places, radii and axes of trees numbered from the root; no cloud.

Tools for neurons and plants open SWC; many compute in float32. Where that would lose digits, as in coordinates of a
map, a shift of whole units is taken off and noted in the header, ``# global_shift: x y z``; reading adds it again.

In MTG, the multiscale tree graphs of Godin and Caraglio (1998) in the syntax of AMAPmod, FORM-A, a plant is decomposed
into nodes, a line each. ``<`` goes on along an axis, ``+`` branches off one column further right, and ``^`` continues
what is above it in its column. TomatoWUR (van Marrewijk et al. 2025, https://github.com/WUR-ABE/TomatoWUR) has
``x, y, z`` in the results of skeleton methods, and ``x_skeleton, y_skeleton, z_skeleton`` in its annotations; its CSV
has both here, so that all its readers take it.
"""

import logging
import re

import numpy as np

from ...analysis.branches import branch_table
from ...decisions import coordinates
from ...errors import FileFormatError
from ...numerics.polylines import arc_lengths
from ...skeleton import Skeleton
from .graphs import global_shift, graph_skeleton, line, parents, text

_log = logging.getLogger(__name__)

NODE_COLUMNS = ("x", "y", "z", "x_skeleton", "y_skeleton", "z_skeleton", "vid", "parentid", "edgetype", "radius")
_SHIFT = re.compile(r"#\s*global_shift:\s*(\S+)\s+(\S+)\s+(\S+)")
_MTG_HEADER = """\
CODE:\tFORM-A

CLASSES:
SYMBOL\tSCALE\tDECOMPOSITION\tINDEXATION\tDEFINITION
$\t0\tFREE\tFREE\tIMPLICIT
P\t1\tCONNECTED\tFREE\tIMPLICIT
N\t2\tNONE\tFREE\tEXPLICIT

DESCRIPTION:
LEFT\tRIGHT\tRELTYPE\tMAX
N\tN\t+\t?
N\tN\t<\t1

FEATURES:
NAME\tTYPE
XX\tREAL
YY\tREAL
ZZ\tREAL
radius\tREAL

MTG:"""


def write_swc(forest: Skeleton) -> bytes:
    """The content of an SWC file of a skeleton that is numbered from its roots outwards."""
    shift = global_shift(forest)
    shift *= ((forest.vertices - shift) + shift == forest.vertices).all()  # what is read must be what was
    header = ["# curve skeleton written by glsk-o3d: id type x y z radius parent"]
    if shift.any():
        _log.warning("written less a global shift of (%s), since float32 would lose digits", coordinates(shift))
        header.append(line("# global_shift:", *shift.tolist()))
    parent = parents(forest)
    number = np.where(parent >= 0, parent + 1, -1).tolist()
    table = np.column_stack([forest.vertices - shift, forest.radii]).tolist()
    rows = [line(i, 0, *row, before) for i, (row, before) in enumerate(zip(table, number, strict=True), 1)]
    return text([*header, *rows])


def read_swc(data: bytes) -> Skeleton:
    """The skeleton in the content of an SWC file."""
    rows = [line for line in data.decode("utf-8", "replace").splitlines() if line.partition("#")[0].strip()]
    if any(len(row.partition("#")[0].split()) < 7 for row in rows) or not rows:
        raise ValueError("it has no rows of 7 numbers (id type x y z radius parent)")
    table = np.loadtxt(rows, ndmin=2, usecols=range(7))
    names, parent = table[:, 0], table[:, 6]
    order = np.argsort(names)
    child = np.flatnonzero(parent >= 0)
    place = np.searchsorted(names[order], parent[child]).clip(max=len(names) - 1)
    if (names[order][place] != parent[child]).any() or len(np.unique(names)) < len(names):
        raise ValueError("a parent is missing, or two rows have the same id")
    shift = _SHIFT.search(data.decode("utf-8", "replace"))
    origin = [float(word) for word in shift.groups()] if shift else 0.0
    return graph_skeleton(table[:, 2:5] + origin, np.column_stack([child, order[place]]), table[:, 5])


def write_mtg(forest: Skeleton) -> bytes:
    """The content of an MTG file of a forest that is numbered outwards: each component is a plant, P1, P2, ..., and
    vertex i the node Ni, with its place in XX, YY and ZZ.
    """
    parent, begins = plant_axes(forest)
    order = np.zeros(len(parent), int)
    children: list[list[int]] = [[] for _ in parent]
    for vertex, before in enumerate(parent.tolist()):
        if before >= 0:
            order[vertex] = order[before] + begins[vertex]
            children[before].append(vertex)
    table, columns = np.column_stack([forest.vertices, forest.radii]), int(order.max(initial=0)) + 1
    rows = [_MTG_HEADER, "\t".join(["ENTITY-CODE", *[""] * (columns - 1), "XX", "YY", "ZZ", "radius"])]
    for plant, root in enumerate(np.flatnonzero(parent < 0).tolist(), 1):
        left = [root]
        while left:
            vertex = left.pop()
            link = f"/P{plant}/" if vertex == root else "+" if begins[vertex] else "^<"
            code = [""] * columns
            code[order[vertex]] = f"{link}N{vertex}"
            rows.append("\t".join(code + [_mtg_number(value) for value in table[vertex]]))
            # what branches off stands right below the node, in the order of its numbers; what goes on comes after it
            left += sorted(children[vertex], key=lambda child: (begins[child], -child))
    return text(rows)


def _mtg_number(value: float) -> str:
    """In full precision and without an exponent, whose sign would read as a branch; empty for what is not known."""
    return np.format_float_positional(value, trim="0") if np.isfinite(value) else ""


def write_csv(tree: Skeleton) -> bytes:
    """The content of a node list of TomatoWUR, a line per vertex of a tree that is numbered outwards; FileFormatError
    if there are several. `edgetype` is ``<`` where the edge from the parent goes on along an axis, else ``+``.
    """
    if tree.n_components > 1:
        raise FileFormatError(
            f"a node list of TomatoWUR holds one plant and the skeleton has {tree.n_components} components: keep "
            "one with editing.largest_component(), or choose another format"
        )
    parent, begins = plant_axes(tree)
    rows = [",".join(NODE_COLUMNS)]
    facts = zip(tree.vertices.tolist(), parent.tolist(), begins.tolist(), tree.radii.tolist(), strict=True)
    for vertex, (place, before, branches_off, radius) in enumerate(facts):
        edge = [before, "+" if branches_off else "<"] if before >= 0 else ["", ""]
        rows.append(",".join(map(str, [*place, *place, vertex, *edge, radius if np.isfinite(radius) else ""])))
    return text(rows)


def plant_axes(forest: Skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Of a forest that is numbered outwards the parent of every vertex, (M,) int array, -1 for roots; and whether the
    edge from it begins an axis, (M,) bool array.

    Axes are those of `BranchTable`, but for a root from which several axes of order 0 grow: there the thickest goes on,
    the longest of those that are as thick.
    """
    parent, begins = parents(forest), np.zeros(len(forest.vertices), bool)
    part = forest.component_of_vertex
    for each in range(forest.n_components):
        (mine,) = np.nonzero(part == each)
        edges = np.searchsorted(mine, forest.edges[part[forest.edges[:, 0]] == each])
        begins[mine[_beginnings(graph_skeleton(forest.vertices[mine], edges, forest.radii[mine]))]] = True
    return parent, begins


def _beginnings(plant: Skeleton) -> list[int]:
    """The first vertices, after the one that they grow from, of all axes but the stem."""
    table = branch_table(plant, 0)
    found: list[int] = []
    at_root: list[tuple[float, float, int]] = []
    for row, path in enumerate(plant.branches):
        foot = int(np.argmin(path))  # an end, unless the root is inside the branch
        for side in (path[foot::-1], path[foot:]):
            if len(side) < 2:
                continue
            if side[0] == 0:
                length = float(arc_lengths(plant.vertices[side])[-1])
                at_root.append((float(np.nan_to_num(table.mean_radius[row])), length, int(side[1])))
            elif table.axis[row] == row:
                found.append(int(side[1]))
    stem = max(at_root, default=None)
    return found + [vertex for *rank, vertex in at_root if stem != (*rank, vertex)]
