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
    "numerics/delaunay_star.py:delaunay_star": "one loop over all hulls at once, whose steps share a dozen arrays",
}
"""Functions of more than 50 lines of code, and why: at most three."""


# ------------------------------------------------------------------------------------------------------------- imports


def test_imports_go_down_but_for_the_comforts():
    assert architecture.upward() == architecture.comforts()  # none but these, and none of these in vain


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


def write_package(folder, **modules):
    """A package of modules by name, with two underscores for a dot."""
    for name, text in modules.items():
        path = folder / "glsk_o3d" / f"{name.replace('__', '/')}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder / "glsk_o3d"


def test_late_imports_count_and_those_for_type_checkers_do_not(tmp_path):
    late = "class Shape:\n    def draw(self):\n        from .b.c import d\n        return d\n"
    typed = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from . import a\n"
    package = write_package(tmp_path, a=late, b__c=typed, b__d="from ..a import Shape\nfrom . import c\n")
    assert architecture.imports(package) == {
        ("a", "a.Shape.draw", "b.c"),
        ("b.d", "b.d", "a"),
        ("b.d", "b.d", "b.c"),
    }


def test_names_of_a_package_with_a_stub_are_traced_to_their_module(tmp_path):
    package = write_package(tmp_path, a="", b__c="from .. import name, __version__\n")
    (package / "__init__.py").touch()
    (package / "__init__.pyi").write_text("from .a import name\n")
    assert architecture.imports(package) == {("b.c", "b.c", "a"), ("b.c", "b.c", "")}


def test_numerics_knows_arrays_alone():
    for path in (PACKAGE / "numerics").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import | ast.ImportFrom):
                names = [node.module or ""] if isinstance(node, ast.ImportFrom) else [each.name for each in node.names]
                assert getattr(node, "level", 0) <= 1, path
                assert not {name.split(".")[0] for name in names} & {"open3d", "matplotlib", "networkx"}, path


# -------------------------------------------------------------------------------------------------------------- lengths


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


def function_lengths():
    """Lines of code in the body of every function, by file and name."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        lines = code_lines(path)
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                body = set(range(node.body[0].lineno, node.end_lineno + 1))
                name = f"{path.relative_to(PACKAGE).as_posix()}:{node.name}"
                found[name] = max(len(lines & body), found.get(name, 0))
    return found


def file_lengths():
    """Lines of every file, docstrings and blank ones too."""
    files = sorted(PACKAGE.rglob("*.py"))
    return {path.relative_to(PACKAGE).as_posix(): len(path.read_text().splitlines()) for path in files}


def test_files_are_short():
    assert {name for name, length in file_lengths().items() if length > 400} == set()


def test_functions_are_short():
    assert {name for name, length in function_lengths().items() if length > 50} == set(LONG_FUNCTIONS)
    assert len(LONG_FUNCTIONS) <= 3


def test_the_first_filter_reads_like_the_list_of_its_steps():
    assert file_lengths()["ring_builder.py"] <= 250
    assert function_lengths()["ring_builder.py:_run"] <= 20
