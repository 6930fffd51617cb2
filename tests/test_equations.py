"""Every equation of Wen et al. 2024 stands at its line, in the function that the page on the method names."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def marked():
    """The functions, methods with their class, that have a comment ``# Wen (9)``: {"9": {names}}."""
    places = {}
    for path in sorted((ROOT / "glsk_o3d").rglob("*.py")):
        module, tree = ".".join(path.relative_to(ROOT).with_suffix("").parts), ast.parse(path.read_text())
        classes = [(f"{module}.{node.name}", node) for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
        functions = [
            (f"{name}.{node.name}", node)
            for name, owner in [(module, tree), *classes]
            for node in owner.body
            if isinstance(node, ast.FunctionDef)
        ]
        for row, line in enumerate(path.read_text().splitlines(), 1):
            for number in re.findall(r"#.*\bWen \(([^)]*)\)", line):
                inside = [name for name, node in functions if node.lineno <= row <= node.end_lineno]
                places.setdefault(number, set()).update(inside or [f"{path}:{row}"])
    return places


def test_the_table_names_the_functions_of_all_equations():
    page = (ROOT / "docs" / "method.md").read_text()
    rows = re.findall(r"^\| (\d+) \| .+ \| (`glsk_o3d\.[^|]+`) \|$", page, re.MULTILINE)
    assert [int(number) for number, _ in rows] == list(range(1, 17))
    assert marked() == {number: set(re.findall(r"`([\w.]+)`", names)) for number, names in rows}
