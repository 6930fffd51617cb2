"""The parts of the package and who may import whom: drawn for the page on the architecture, and tested."""

import ast
from pathlib import Path
from typing import NamedTuple

import networkx as nx
from matplotlib import rc_context
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

PACKAGE = Path(__file__).resolve().parents[2] / "glsk_o3d"

ROWS = (
    {"command line": ("cli", "__main__")},
    {"applications": ("apps",)},
    {"pictures and windows": ("viewing",)},
    {"files": ("io",)},
    {"tracking": ("tracking",)},
    {"editing": ("editing",)},
    {"analysis": ("analysis",)},
    {"api": ("api",)},
    {"recipes and plugins": ("recipes",)},
    {"named pipelines": ("pipelines",)},
    {"filters": ("filters",)},
    {"curve": ("curve",), "pipeline": ("pipeline",)},
    {"data": ("data",)},
    {"parameters": ("parameters",), "samples": ("samples",)},
    {"geometry": ("geometry",), "other packages, and files": ("interop",)},
    {"errors": ("errors",)},
)
"""Boxes by row, users above the used, and the modules and packages in each."""

ASIDE = {
    **dict.fromkeys(("pipeline", "samples"), 3.0),
    "other packages, and files": 2.4,
}
"""Where in the drawing the boxes are that are not in its middle."""


class Import(NamedTuple):
    """An import inside the package, names without the package's own."""

    module: str
    """Where it stands."""
    place: str
    """The same with the class and function that it stands in, if it does."""
    target: str
    """The module that it needs; a name of a package is traced to the module that the package's stub has it from."""


def box_of(module):
    """The box that a module such as ``"io.ply"`` is in, None for the package itself."""
    return next((box for row in ROWS for box, names in row.items() if module.split(".")[0] in names), None)


def imports(package=PACKAGE):
    """All imports inside the package, the late ones in functions and those for type checkers too.

    Returns
    -------
    set of Import
    """
    modules = {name_of(path, package): path for path in package.rglob("*.py")}
    stubs = {
        name_of(path, package): {
            alias.asname or alias.name: target
            for node in ast.parse(path.read_text()).body
            for target, alias in targets(node, path, package, modules)
        }
        for path in package.rglob("__init__.pyi")
    }
    found = set()

    def walk(node, module, place):
        for child in ast.iter_child_nodes(node):
            for target, alias in targets(child, modules[module], package, modules):
                found.add(Import(module, place, stubs.get(target, {}).get(alias.name, target)))
            named = isinstance(child, ast.ClassDef | ast.FunctionDef)
            walk(child, module, f"{place}.{child.name}" if named else place)

    for name, path in modules.items():
        walk(ast.parse(path.read_text()), name, name)
    return found


def name_of(path, package):
    """The name of a module without the package's, that of a package without ``__init__``."""
    return ".".join(path.relative_to(package).with_suffix("").parts).removesuffix("__init__").removesuffix(".")


def targets(node, path, package, modules):
    """Yield what a statement imports from the package: the module, and what of it."""
    if isinstance(node, ast.Import) and any(alias.name.split(".")[0] == package.name for alias in node.names):
        raise ValueError(f"{path}:{node.lineno}: imports inside the package are relative")
    if isinstance(node, ast.ImportFrom) and node.level:
        here = path.relative_to(package).parts[: -node.level]
        base = [*here, *(node.module.split(".") if node.module else ())]
        for alias in node.names:
            whole = ".".join([*base, alias.name])
            yield whole if whole in modules else ".".join(base), alias


def upward():
    """The imports that go up, or sideways out of their box, as a set of (place, target)."""
    row = {box: n for n, boxes in enumerate(ROWS) for box in boxes}
    pairs = {(each.place, each.target): (box_of(each.module), box_of(each.target)) for each in imports()}
    return {pair for pair, (a, b) in pairs.items() if a and b and a != b and row[b] <= row[a]}


def circles():
    """The circles of modules that import each other, as a list of sets."""
    graph = nx.DiGraph((each.module, each.target) for each in imports())
    return [found for found in nx.strongly_connected_components(graph) if len(found) > 1]


def arrows():
    """Which box imports which other one, as a set of (str, str)."""
    pairs = {(box_of(each.module), box_of(each.target)) for each in imports()}
    return {(a, b) for a, b in pairs if a and b and a != b}


def draw():
    """The boxes, and an arrow for every import that does not already follow from others."""
    place = {box: (ASIDE.get(box, 0), -y) for y, row in enumerate(ROWS) for box in row}
    figure = Figure((8, 8.4), layout="constrained", facecolor="white")
    FigureCanvasSVG(figure)
    axes = figure.add_subplot()
    axes.set(xlim=(-5, 5), ylim=(-len(ROWS) + 0.4, 0.6))
    axes.set_axis_off()
    for a, b in sorted(nx.transitive_reduction(nx.DiGraph(arrows())).edges):
        (x, y), (u, v) = place[a], place[b]
        style = dict(arrowstyle="-|>", color="#888888", linewidth=0.9, shrinkA=0, shrinkB=0)
        axes.annotate("", (u, v + 0.27), (x, y - 0.27), arrowprops=style, zorder=0)
    for box, modules in (item for row in ROWS for item in row.items()):
        x, y = place[box]
        names = "" if modules == (box,) else ", ".join(modules)
        half = 1.2 if len(names) < 25 else 1.6 if len(names) < 45 else 2.4
        style = dict(boxstyle="round,pad=0,rounding_size=0.08", facecolor="#f3f0ea", edgecolor="#333333", linewidth=0.8)
        axes.add_patch(FancyBboxPatch((x - half, y - 0.25), 2 * half, 0.5, **style))
        axes.text(x, y + 0.09 * bool(names), box, ha="center", va="center", fontsize=9, color="#222222")
        axes.text(x, y - 0.12, names, ha="center", va="center", fontsize=6.5, color="#666666", family="monospace")
    return figure


def write(folder: Path) -> None:
    """Draw the diagram, the same bytes from the same imports."""
    with rc_context({"svg.hashsalt": "architecture"}):
        draw().savefig(folder / "architecture.svg", metadata=dict.fromkeys(("Creator", "Date")))
