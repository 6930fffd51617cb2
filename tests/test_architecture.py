"""Who imports whom, and how long files and functions are."""

import ast
import importlib
import io
import re
import sys
import tokenize
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "glsk_o3d"
sys.path.insert(0, str(ROOT / "docs" / "_ext"))
architecture = importlib.import_module("architecture")
sys.path.pop(0)

LONG_FUNCTIONS = {
    "geometry/delaunay_star.py:delaunay_star": "one loop over all hulls at once, whose steps share a dozen arrays"
}
"""Functions of more than 50 lines of code, and why: at most three."""


def test_imports_go_down():
    assert architecture.upward() == set()


def test_there_are_no_circles():
    assert architecture.circles() == []


def test_every_module_has_its_box():
    modules = {architecture.name_of(path, PACKAGE) for path in PACKAGE.rglob("*.py")} - {""}
    assert {module for module in modules if architecture.box_of(module) is None} == set()
    boxes = [name for row in architecture.ROWS for names in row.values() for name in names]
    assert sorted(boxes) == sorted({module.split(".")[0] for module in modules})


def test_the_diagram_is_that_of_the_code(tmp_path):
    architecture.write(tmp_path)
    drawn, shown = ((folder / "architecture.svg").read_text() for folder in (tmp_path, ROOT / "docs" / "images"))
    for part in ("<!-- .+ -->", 'id="patch_'):  # words, and boxes and arrows; fonts are each machine's own
        assert re.findall(part, shown) == re.findall(part, drawn), "make figures"


def test_geometry_knows_arrays_alone():
    for path in (PACKAGE / "geometry").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import | ast.ImportFrom):
                names = [node.module or ""] if isinstance(node, ast.ImportFrom) else [each.name for each in node.names]
                assert getattr(node, "level", 0) <= 1 or names == ["errors"], path
                assert not {name.split(".")[0] for name in names} & {"open3d", "matplotlib", "networkx"}, path


def code_lines(path):
    """The numbers of the lines that are neither blank, nor comment, nor docstring."""
    text = path.read_text()
    idle = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
    lines = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in idle:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            lines.difference_update(range(node.lineno, node.end_lineno + 1))
    return lines


def test_files_and_functions_are_short():
    """Files have at most 400 lines, docstrings and blank ones too; functions at most 50 lines of code."""
    files, functions = {}, {}
    for path in sorted(PACKAGE.rglob("*.py")):
        text, lines, name = path.read_text(), code_lines(path), path.relative_to(PACKAGE).as_posix()
        files[name] = len(text.splitlines())
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                body = len(lines & {*range(node.body[0].lineno, node.end_lineno + 1)})
                functions[f"{name}:{node.name}"] = max(body, functions.get(f"{name}:{node.name}", 0))
    assert {name for name, length in files.items() if length > 400} == set()
    assert {name for name, length in functions.items() if length > 50} == set(LONG_FUNCTIONS)
    assert len(LONG_FUNCTIONS) <= 3
    assert functions["filters/ring_builder.py:run"] <= 20  # the first filter reads like the list of its steps
