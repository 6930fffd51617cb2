"""Every equation of Wen et al. 2024 stands at its line, in the function that the page on the method names."""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
NUMBERS = range(1, 17)


def table():
    """The functions by equation, from the page."""
    page = (ROOT / "docs" / "method.md").read_text()
    rows = re.findall(r"^\| (\d+) \| .+ \| (`glsk_o3d\.[^|]+`) \|$", page, re.MULTILINE)
    return [(int(number), set(re.findall(r"`([\w.]+)`", names))) for number, names in rows]


def functions(path):
    """The functions of a file and their lines; methods with their class, all with their module."""
    found = {}

    def walk(node, name):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.ClassDef | ast.FunctionDef):
                inner = f"{name}.{child.name}"
                if isinstance(child, ast.FunctionDef):
                    found[inner] = range(child.lineno, child.end_lineno + 1)
                walk(child, inner)

    walk(ast.parse(path.read_text()), ".".join(path.relative_to(ROOT).with_suffix("").parts))
    return found


@pytest.fixture(scope="module")
def places():
    """Where the equations stand: (what is in the brackets, the innermost function or else the line of the file)."""
    found = []
    for path in sorted((ROOT / "glsk_o3d").rglob("*.py")):
        spans = functions(path)
        for token in tokenize.generate_tokens(io.StringIO(path.read_text()).readline):
            for number in re.findall(r"\bWen \(([^)]*)\)", token.string) if token.type == tokenize.COMMENT else ():
                around = [name for name, lines in spans.items() if token.start[0] in lines]
                found.append((number, max(around, key=len, default=f"{path}:{token.start[0]}")))
    return found


def test_the_table_has_all_equations():
    assert [number for number, _ in table()] == list(NUMBERS)


@pytest.mark.parametrize("number", NUMBERS)
def test_an_equation_stands_in_the_functions_that_the_table_names(places, number):
    assert {place for told, place in places if told == str(number)} == dict(table())[number]


def test_there_are_no_other_numbers(places):
    assert {told for told, _ in places} == {str(number) for number in NUMBERS}
