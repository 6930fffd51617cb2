"""Constants: one name for one thing, and where each number comes from."""

import ast
import importlib
import sys
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE, BENCHMARK = ROOT / "glsk_o3d", ROOT / "benchmarks" / "src" / "glsk_bench"
ROOMS = (
    *(PACKAGE / name for name in ("geometry", "curve", "analysis", "apps/crosscheck")),
    *(BENCHMARK, BENCHMARK / "shapes", BENCHMARK / "shapes" / "things"),
)
sys.path.insert(0, str(ROOT / "docs" / "_ext"))
steering = importlib.import_module("steering")
sys.path.pop(0)
NUMERIC = sorted({*steering.files(), *(path for room in ROOMS for path in room.rglob("*.py"))})


def test_no_constant_is_assigned_in_two_modules():
    count = Counter(
        name
        for path in (*PACKAGE.rglob("*.py"), *BENCHMARK.rglob("*.py"))
        for name in {name for name, _ in steering.constants(ast.parse(path.read_text(encoding="utf-8")))}
    )
    assert [name for name, times in count.items() if times > 1] == []


@pytest.mark.parametrize("path", NUMERIC, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_number_says_where_it_comes_from(path):
    text = path.read_text(encoding="utf-8")
    silent = [
        name
        for name, statement in steering.constants(ast.parse(text))
        if steering.is_number(statement.value) and not steering.origin(steering.comments(text.splitlines(), statement))
    ]
    assert silent == []


def test_the_numbers_of_all_steps_are_listed():
    numbers = steering.steering()
    assert {each.name for each in numbers} >= {"amplification", "limb: crease", "line_variance", "diffusion"}
    assert all(each.what and each.origin for each in (*numbers, *steering.all_fields()))


UNITS = {0.0, 0.5, 1.0, 2.0}
"""Floats that need no name: nothing, halves, wholes and doubles."""


@pytest.mark.parametrize("room", ["curve", "filters"])
def test_no_number_hides_in_a_function(room):
    hidden = [
        f"{path.relative_to(PACKAGE)}:{node.lineno}: {node.value}"
        for path in (PACKAGE / room).rglob("*.py")
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(function, ast.FunctionDef)
        for node in ast.walk(function)
        if isinstance(node, ast.Constant) and type(node.value) is float and node.value not in UNITS
    ]
    assert hidden == []
