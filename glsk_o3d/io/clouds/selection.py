"""Which points of a scan: ``classification == 5 and z > 2``."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from functools import reduce
from typing import Any

import numpy as np

from ...errors import InvalidCloudError, InvalidParameterError, did_you_mean
from .scanned import Scan

__all__ = ["select"]

_COMPARISONS: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: np.isin,
    ast.NotIn: lambda values, among: ~np.isin(values, among),
}
_JOINS = {ast.And: np.logical_and, ast.Or: np.logical_or}


def select(scan: Scan, where: str) -> Scan:
    """The points of a scan for which a condition holds.

    Parameters
    ----------
    scan : Scan
    where : str
        Comparisons of attributes, ``x``, ``y`` and ``z`` with numbers or with each other, joined by ``and``, ``or`` and
        ``not``: ``classification == 5 and not 0 < z < 2``, ``treeID in (3, 4)``.

    Returns
    -------
    Scan

    Raises
    ------
    InvalidParameterError
        It is no such condition, or names what the points do not have.
    InvalidCloudError
        It holds for no point.

    Examples
    --------
    >>> scan = Scan(np.eye(3), attributes={"label": np.array([7, 8, 8])})
    >>> select(scan, "label == 8 and z < 0.5").positions
    array([[0., 1., 0.]])
    """
    chosen = chosen_points(scan, where)
    if not chosen.any():
        raise none_chosen(where)
    return scan[chosen]


def chosen_points(scan: Scan, where: str) -> np.ndarray:
    """For which points a condition holds, (N,) bool array; InvalidParameterError as from `select`."""
    try:
        chosen = np.asarray(_value(parsed(where), scan.columns))
    except (TypeError, ValueError) as error:
        if isinstance(error, InvalidParameterError):
            raise
        raise InvalidParameterError(f"where = {where!r}: cannot be compared: write such as 'label in (1, 2)'") from None
    if chosen.shape != (len(scan),) or chosen.dtype != bool:
        raise InvalidParameterError(f"where = {where!r}: is no condition on points: write such as 'label == 5'")
    return chosen


def none_chosen(where: str) -> InvalidCloudError:
    """The error for a condition that holds for no point."""
    return InvalidCloudError(f"there is no point with {where}")


def parsed(where: str) -> ast.expr:
    """A condition as a tree of Python's grammar; InvalidParameterError if it is none."""
    try:
        return ast.parse(where.strip(), mode="eval").body
    except (SyntaxError, RecursionError, MemoryError) as error:
        why = getattr(error, "msg", "it is nested too deeply")
        cure = "write such as 'classification == 5 and not z < 2', and class_ for class"
        raise InvalidParameterError(f"where = {where[:200]!r}: {why}: {cure}") from None


def _value(node: ast.AST, columns: Mapping[str, np.ndarray]) -> Any:
    """What a part of an expression comes to; nothing but the grammar of `select` is let through."""
    match node:
        case ast.BoolOp(op=op, values=parts):
            return reduce(_JOINS[type(op)], [_value(part, columns) for part in parts])
        case ast.UnaryOp(op=ast.Not(), operand=part):
            return np.logical_not(_value(part, columns))
        case ast.UnaryOp(op=ast.USub(), operand=part):
            return np.negative(_value(part, columns), dtype=float)
        case ast.Compare(left=left, ops=ops, comparators=rest) if all(type(op) in _COMPARISONS for op in ops):
            sides = [_value(part, columns) for part in (left, *rest)]
            pairs = zip(ops, sides, sides[1:], strict=False)
            return reduce(np.logical_and, [_COMPARISONS[type(op)](a, b) for op, a, b in pairs])
        case ast.Tuple(elts=parts) | ast.List(elts=parts) | ast.Set(elts=parts):
            return [_value(part, columns) for part in parts]
        case ast.Constant(value=int() | float() as number):
            return number
        case ast.Name(id=name):
            if name not in columns:
                raise InvalidParameterError(did_you_mean(name, columns, "attribute of the points"))
            return columns[name]
    raise InvalidParameterError(f"{ast.unparse(node)!r} is not understood: compare attributes with numbers")
