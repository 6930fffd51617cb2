"""The diagram of the architecture page: boxes by hand, arrows from the imports of the code."""

import ast
from collections import defaultdict
from pathlib import Path

import networkx as nx
from matplotlib import rc_context
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

PACKAGE = Path(__file__).resolve().parents[2] / "glsk_o3d"

ROWS = (
    {"command line": ("cli", "__main__")},
    {"batch": ("batch",), "viewing": ("viewing",), "MeshLab": ("interop.meshlab",)},
    {
        "recipes, plugins, catalogue": ("recipes", "plugins", "catalogue", "summary"),
        "analysis": ("analysis",),
        "reduction": ("reduction",),
    },
    {"pipeline": ("pipeline", "pipelines")},
    {"filters": ("ring_builder", "contractor", "lpr_reducer", "connector", "refiner")},
    {"what filters share": ("filter", "stopping"), "files and pictures": ("interop",)},
    {"what flows between them": ("state", "skeleton"), "refinement": ("refinement",)},
    {"report": ("report",), "numerics": ("numerics",), "samples": ("samples",)},
    {"Open3D's clouds": ("interop.open3d", "interop.verbosity")},
    {"errors": ("errors",)},
)
"""Boxes by row, users above the used, and the modules in each; the longest name that fits counts."""


def box_of(module):
    """The box that a module of the package is in, None for the package itself.

    Parameters
    ----------
    module : str
        Without the package, such as ``"interop.files"``.
    """
    known = {prefix: box for row in ROWS for box, prefixes in row.items() for prefix in prefixes}
    words = module.split(".")
    return next((known[".".join(words[:n])] for n in range(len(words), 0, -1) if ".".join(words[:n]) in known), None)


def imports(package=PACKAGE):
    """What each module imports when it is imported itself: not inside functions, and not for type checkers.

    Returns
    -------
    dict of str to set of str
        Names without the package.
    """
    modules = {".".join(path.relative_to(package).with_suffix("").parts): path for path in package.rglob("*.py")}
    found = defaultdict(set)
    for name, path in modules.items():
        here = (
            name.removesuffix("__init__").removesuffix(".").split(".")
            if name.endswith("__init__")
            else name.split(".")[:-1]
        )
        for node in ast.parse(path.read_text()).body:
            if not (isinstance(node, ast.ImportFrom) and node.level):
                continue
            base = here[: len(here) - node.level + 1] + (node.module or "").split(".") * bool(node.module)
            for alias in node.names:
                whole = ".".join([*base, alias.name])
                target = whole if whole in modules or f"{whole}.__init__" in modules else ".".join(base)
                if target:
                    found[name.removesuffix(".__init__")].add(target)
    return {name.removesuffix(".__init__"): found[name.removesuffix(".__init__")] for name in modules}


def arrows():
    """Which box imports which other one, set of (str, str)."""
    pairs = {(box_of(name), box_of(target)) for name, targets in imports().items() for target in targets}
    return {(a, b) for a, b in pairs if a and b and a != b}


def draw():
    """The boxes, and an arrow for every import that does not already follow from others."""
    place, top = {}, len(ROWS)
    figure = Figure((8, 8.4), layout="constrained", facecolor="white")
    FigureCanvasSVG(figure)
    axes = figure.add_subplot()
    axes.set(xlim=(-5, 5), ylim=(-0.6, top - 0.4))
    axes.set_axis_off()
    for y, row in enumerate(reversed(ROWS)):
        for n, box in enumerate(row):
            place[box] = ((n - (len(row) - 1) / 2) * (10 / max(len(row), 3)), y)
    for a, b in sorted(nx.transitive_reduction(nx.DiGraph(arrows())).edges):
        (x, y), (u, v) = place[a], place[b]
        style = dict(arrowstyle="-|>", color="#888888", linewidth=0.9, shrinkA=0, shrinkB=0)
        axes.annotate("", (u, v + 0.27), (x, y - 0.27), arrowprops=style, zorder=0)
    for row in ROWS:
        for box, prefixes in row.items():
            x, y = place[box]
            names = ", ".join(prefixes)
            names = names if names != box else ""
            half = 1.1 if len(row) > 3 else 1.5 if len(names) < 40 else 2.6
            axes.add_patch(
                FancyBboxPatch(
                    (x - half, y - 0.25),
                    2 * half,
                    0.5,
                    boxstyle="round,pad=0,rounding_size=0.08",
                    facecolor="#f3f0ea",
                    edgecolor="#333333",
                    linewidth=0.8,
                )
            )
            axes.text(x, y + 0.09 * bool(names), box, ha="center", va="center", fontsize=9, color="#222222")
            axes.text(x, y - 0.12, names, ha="center", va="center", fontsize=6.5, color="#666666", family="monospace")
    return figure


def write(folder: Path) -> None:
    """Draw the diagram, the same bytes from the same imports."""
    with rc_context({"svg.hashsalt": "architecture"}):
        draw().savefig(folder / "architecture.svg", metadata=dict.fromkeys(("Creator", "Date")))


def upward():
    """Imports that go up, or sideways into another box of the same row, set of (str, str)."""
    row = {box: n for n, boxes in enumerate(ROWS) for box in boxes}
    return {(a, b) for a, b in arrows() if row[b] <= row[a]}
