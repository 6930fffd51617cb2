"""Constants: one name for one thing, and where each number comes from."""

import ast
import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE, BENCHMARK = ROOT / "glsk_o3d", ROOT / "benchmarks" / "src" / "glsk_bench"
ROOMS = (
    *(PACKAGE / name for name in ("numerics", "preparation", "refinement", "analysis", "crosscheck")),
    *(BENCHMARK, BENCHMARK / "shapes"),
)
FILTERS = ("ring_builder", "contractor", "lpr_reducer", "connector", "refiner", "stopping")
NUMERIC = sorted([*(PACKAGE / f"{name}.py" for name in FILTERS), *(p for room in ROOMS for p in room.glob("*.py"))])
ORIGIN = re.compile(r"\b(derived|published|measured|fitted)\b", re.IGNORECASE)


def constants(tree):
    """The upper-case names that a module assigns, each with its statement."""
    for statement in tree.body:
        if isinstance(statement, (ast.Assign, ast.AnnAssign)):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            for node in (node for target in targets for node in ast.walk(target)):
                if isinstance(node, ast.Name) and node.id.isupper():
                    yield node.id, statement


def is_number(value):
    """Whether an expression is made of plain numbers: one, a tuple of them, or arithmetic."""
    if isinstance(value, (ast.Tuple, ast.List)):
        return bool(value.elts) and all(map(is_number, value.elts))
    if isinstance(value, ast.BinOp):
        return is_number(value.left) and is_number(value.right)
    if isinstance(value, ast.UnaryOp):
        return is_number(value.operand)
    return ast.unparse(value) == "np.pi" or (isinstance(value, ast.Constant) and type(value.value) in (int, float))


def said(lines, statement):
    """The comments of a statement: at its end, directly above it, and above the group that it is in."""
    first, end = statement.lineno - 1, statement.end_lineno
    top = first
    while top and lines[top - 1].strip():
        top -= 1
    group = next((row for row in range(top, first) if not lines[row].startswith("#")), first)
    own = next((row + 1 for row in range(first - 1, top - 1, -1) if not lines[row].startswith("#")), top)
    tail = lines[end - 1].partition("#")[2]
    return "\n".join([*lines[top:group], *lines[own:first], tail])


def test_no_constant_is_assigned_in_two_modules():
    count = Counter(
        name
        for path in (*PACKAGE.rglob("*.py"), *BENCHMARK.rglob("*.py"))
        for name in {name for name, _ in constants(ast.parse(path.read_text(encoding="utf-8")))}
    )
    assert [name for name, times in count.items() if times > 1] == []


@pytest.mark.parametrize("path", NUMERIC, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_number_says_where_it_comes_from(path):
    text = path.read_text(encoding="utf-8")
    silent = [
        name
        for name, statement in constants(ast.parse(text))
        if is_number(statement.value) and not ORIGIN.search(said(text.splitlines(), statement))
    ]
    assert silent == []
