"""MTG, the multiscale tree graphs of plant modellers: keeps places, radii and axes of trees; loses all else.

The model is that of Godin and Caraglio (1998), the syntax that of AMAPmod, FORM-A: a plant is decomposed into nodes, a
line each. ``<`` goes on along an axis, ``+`` branches off one column further right, and ``^`` continues what is above
it in its column.
"""

from __future__ import annotations

import numpy as np

from ...skeleton import Skeleton
from .plant_axes import plant_axes
from .text import text

_HEADER = """\
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


def write(skeleton: Skeleton) -> bytes:
    """The content of an MTG file.

    Parameters
    ----------
    skeleton : Skeleton
        Without loops, numbered from its roots outwards as by `editing.reroot`. Each component becomes a plant, P1, P2,
        ..., and vertex i the node Ni, with its place in XX, YY and ZZ.

    Returns
    -------
    bytes

    Examples
    --------
    >>> stem = Skeleton([[0, 0, 0], [0, 0, 1]], [[0, 1]], [0.2, 0.1], (), (), ())
    >>> for line in write(stem).decode().splitlines()[-3:]:
    ...     print(*line.split())
    ENTITY-CODE XX YY ZZ radius
    /P1/N0 0.0 0.0 0.0 0.2
    ^<N1 0.0 0.0 1.0 0.1
    """
    parent, begins = plant_axes(skeleton)
    order = np.zeros(len(parent), int)
    children: list[list[int]] = [[] for _ in parent]
    for vertex, before in enumerate(parent.tolist()):
        if before >= 0:
            order[vertex] = order[before] + begins[vertex]
            children[before].append(vertex)
    table, columns = np.column_stack([skeleton.vertices, skeleton.radii]), int(order.max(initial=0)) + 1
    rows = [_HEADER, "\t".join(["ENTITY-CODE", *[""] * (columns - 1), "XX", "YY", "ZZ", "radius"])]
    for plant, root in enumerate(np.flatnonzero(parent < 0).tolist(), 1):
        left = [root]
        while left:
            vertex = left.pop()
            link = f"/P{plant}/" if vertex == root else "+" if begins[vertex] else "^<"
            code = [""] * columns
            code[order[vertex]] = f"{link}N{vertex}"
            rows.append("\t".join(code + [_number(value) for value in table[vertex]]))
            # what branches off stands right below the node, in the order of its numbers; what goes on comes after it
            left += sorted(children[vertex], key=lambda child: (begins[child], -child))
    return text(rows)


def _number(value: float) -> str:
    """In full precision and without an exponent, whose sign would read as a branch; empty for what is not known."""
    return np.format_float_positional(value, trim="0") if np.isfinite(value) else ""
