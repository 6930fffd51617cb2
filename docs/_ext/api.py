"""The pages of the API reference, one per task and one per public name, and the links in docstrings.

A Sphinx extension; the tests read its lists without Sphinx.
"""

import importlib
import inspect
import re
from pathlib import Path

GENERATED = Path(__file__).resolve().parents[1] / "generated"

TASKS = {
    "skeletons": ("From a cloud to its skeleton", "glsk_o3d"),
    "filters": ("Filters and stopping rules", "glsk_o3d"),
    "pipelines": ("Pipelines", "glsk_o3d"),
    "named_pipelines": ("Named pipelines", "glsk_o3d.pipelines"),
    "recipes": ("Pipelines as files", "glsk_o3d"),
    "io": ("Reading and writing", "glsk_o3d"),
    "viewing": ("Pictures", "glsk_o3d"),
    "analysis": ("Analysis", "glsk_o3d.analysis"),
    "editing": ("Edits of a skeleton", "glsk_o3d.editing"),
    "batch": ("Many clouds", "glsk_o3d.apps.batch"),
    "crosscheck": ("Cross-check with a mesh", "glsk_o3d.apps.crosscheck"),
    "samples": ("Sample clouds", "glsk_o3d.samples"),
    "benchmark": ("The benchmark", "glsk_bench"),
    "benchmark_shapes": ("Shapes of the benchmark", "glsk_bench.shapes"),
    "benchmark_clouds": ("Clouds of the benchmark", "glsk_bench.clouds"),
    "meshlab": ("MeshLab", "glsk_o3d"),
    "errors": ("Errors and warnings", "glsk_o3d"),
}
"""The pages, in the order of the menu: their purpose, and the package that users import from."""
NAMES = {
    "skeletons": {
        "One call": ("skeletonize", "Skeleton"),
        "One object in time": ("Tracker", "Tracked"),
        "Which parts depend on single points": ("support", "Supported"),
        "The record of a run": ("Report", "IterationRecord", "Decision", "Reason", "Verdict"),
        "Fewer points, without a skeleton": ("remove_redundant_points",),
    },
    "filters": {
        "Preparing a cloud": ("Sampler", "OutlierRemover", "Denoiser", "Thinner"),
        "The five filters": ("RingBuilder", "Contractor", "LPRReducer", "Connector", "Refiner"),
        "Thin parts and trees": ("Tracer",),
        "When to stop": ("ExplainedScore", "RingSizeRatio"),
    },
    "pipelines": {
        "Joining filters": ("Pipeline", "Filter"),
        "Their data": ("Cloud", "Points", "Contraction"),
    },
    "named_pipelines": {
        "For general use": ("default", "fast", "tree"),
        "The first half": ("rings",),
        "As they were published": ("wen2024", "cao2010"),
    },
    "recipes": {
        "Writing and reading": ("save_recipe", "load_recipe", "to_recipe", "from_recipe"),
    },
    "io": {
        "As objects of Open3D and pymeshlab": ("to_line_set", "to_tubes", "to_voxels", "to_pymeshlab", "annotate"),
        "Clouds": ("read_cloud", "read_tensor_cloud", "read_sample", "annotate_file"),
        "Skeletons": ("read_skeleton", "save_skeleton", "read_truth"),
        "For other programs": ("save_rig",),
    },
    "viewing": {
        "Pictures and pages": ("plot_skeleton", "save_preview", "save_report"),
    },
    "analysis": {
        "Branches": ("branch_table", "BranchTable", "segment"),
        "Trees": ("tree_measures", "TreeMeasures", "stem", "Stem", "cylinders", "Cylinders", "diameter_classes"),
        "Grasps": ("scene_objects", "SceneObject", "grasp_candidates", "GraspCandidates", "Gripper"),
        "Measures without a truth": ("assess", "Assessment"),
        "Measures against a known axis": ("compare", "Comparison", "Truth"),
    },
    "editing": {
        "Removal of parts": ("prune", "largest_component", "cut_loops"),
        "Other vertices": ("resample", "simplify", "smooth"),
        "Other coordinates": ("transform",),
        "More or less detail": ("detailed",),
        "Another root": ("reroot",),
    },
    "batch": {
        "Running": ("run_batch", "BatchResult"),
        "Plans": ("plan_batch", "Plan"),
    },
    "crosscheck": {"The check": ("cross_check", "CrossCheck")},
    "samples": {
        "By name": ("sample_object", "Sample"),
        "With limbs": ("sauropod", "tree", "y_junction"),
        "Tubes and rings": ("tube", "helix", "torus", "two_rings"),
        "Without an axis": ("sphere", "sheet"),
        "Distances": ("signed_distance",),
    },
    "benchmark": {
        "Its clouds": ("make", "read_folder", "BenchmarkFolder", "ThingTruth"),
        "Clouds of your own": ("add_shape",),
        "Answers": ("run",),
        "Scores": ("score", "Scores", "score_answers", "Results", "read_results", "leaderboard", "Leaderboard"),
        "Repeated": ("sample", "repeat", "Repeat", "spread"),
        "Raters": ("draw_sheet", "rates", "kappa"),
    },
    "benchmark_shapes": {"One draw": ("shape", "Shape", "Thing")},
    "benchmark_clouds": {"One draw": ("cloud",), "The visible share of the axis": ("coverage",)},
    "meshlab": {"A session": ("MeshSet",)},
    "errors": {
        "All errors": ("GlskError",),
        "Wrong input": ("InvalidCloudError", "InvalidParameterError", "FileFormatError", "RecipeError", "ScriptError"),
        "Errors during a run": ("StageError", "BatchError", "DisplayError", "MissingPackageError"),
        "Warnings": ("SkeletonWarning", "PluginWarning"),
    },
}
"""The names on each page, by purpose."""
PACKAGES = tuple(dict.fromkeys(module for _, module in TASKS.values()))
"""The packages that users import from."""
MODULES = {
    "glsk_o3d.parameters": "Making filters",
    "glsk_o3d.interop.clouds": "Clouds",
    "glsk_o3d.recipes.catalogue": "Filters and pipelines by name",
    "glsk_o3d.recipes.plugins": "Plugins",
}
"""The modules that plugins import from."""


FOREIGN_BASES = ("object", "str", "BaseException", "tuple", "MeshSet", "Generic")  # whose members no page repeats


def names(module):
    """The public functions and classes of a module: those with a task, or else all that it defines."""
    if module in PACKAGES:
        pages = [page for page, (_, package) in TASKS.items() if package == module]
        return [name for page in pages for group in NAMES[page].values() for name in group]
    return defined(module)


def defined(module):
    """The names in ``__all__``, or else those of the functions and classes that the module defines, in its order."""
    loaded = importlib.import_module(module)
    own = [name for name, thing in vars(loaded).items() if getattr(thing, "__module__", None) == module]
    public = getattr(loaded, "__all__", [name for name in own if not name.startswith("_")])
    return [name for name in public if callable(getattr(loaded, name))]


def heading(title, line):
    return (title, line * len(title), "")


def listed(module, names):
    """Lines of a list of names with the first sentence of each."""
    yield from (f".. currentmodule:: {module}", "", ".. autosummary::", "   :nosignatures:", "")
    yield from (*(f"   {name}" for name in names), "")


def menu(pages):
    """Lines of a list of pages that only the menu shows."""
    yield from (".. toctree::", "   :hidden:", "", *(f"   {page}" for page in pages), "")


def task_pages():
    """A page per task, and one for plugins."""
    for page, (title, module) in TASKS.items():
        lines = [*heading(title, "="), *((f".. automodule:: {module}", "") if module != "glsk_o3d" else ())]
        for task, group in NAMES[page].items():
            lines += [*heading(task, "-"), *listed(module, group)]
        yield page, [*lines, *menu(f"{module}.{name}" for group in NAMES[page].values() for name in group)]
    lines = [*heading("For those who extend it", "="), "Plugins may use these parts of the package, too.", ""]
    for module, title in MODULES.items():
        lines += [*heading(title, "-"), f".. automodule:: {module}", "", *listed(module, own(module))]
    yield "extending", [*lines, *menu(f"{module}.{name}" for module in MODULES for name in own(module))]


def own(module):
    """The names of a module that users do not import from anywhere else, nor from a module before it."""
    order = [*PACKAGES, *MODULES]
    before = [getattr(importlib.import_module(m), name) for m in order[: order.index(module)] for name in names(m)]
    loaded = importlib.import_module(module)
    return [name for name in names(module) if not any(getattr(loaded, name) is other for other in before)]


def name_pages():
    """A page per name."""
    for module in (*PACKAGES, *MODULES):
        for name in own(module):
            kind = "class" if inspect.isclass(getattr(importlib.import_module(module), name)) else "function"
            inherited = f"   :inherited-members: {', '.join(FOREIGN_BASES)}"
            members = ("   :members:", inherited, "   :show-inheritance:") if kind == "class" else ()
            lines = (*heading(name, "="), f".. currentmodule:: {module}", f".. auto{kind}:: {module}.{name}", *members)
            yield f"{module}.{name}", [*lines, ""]


def overview():
    """The first page: everything, by task."""
    lines = [
        *heading("API reference", "="),
        "Every public name, by purpose.",
        "",
        ".. automodule:: glsk_o3d",
        "",
    ]
    for page, (title, module) in TASKS.items():
        link = f":doc:`{title} <{page}>`"
        lines += [*heading(link, "-"), f"``{module}``", ""]
        lines += listed(module, [name for group in NAMES[page].values() for name in group])
    lines += [*heading(":doc:`For those who extend it <extending>`", "-")]
    lines += [*(f"- ``{module}``: {title.lower()}" for module, title in MODULES.items()), ""]
    return [*lines, *menu([*TASKS, "extending"])]


def write(folder: Path) -> None:
    """Write ``api/index.rst``, a page per task and a page per name."""
    pages = {page: "\n".join(lines) for page, lines in [("index", overview()), *task_pages(), *name_pages()]}
    folder = folder / "api"
    folder.mkdir(parents=True, exist_ok=True)
    for old in set(folder.glob("*.rst")) - {folder / f"{name}.rst" for name in pages}:
        old.unlink()
    for name, text in pages.items():
        page = folder / f"{name}.rst"
        if not page.exists() or page.read_text() != text:  # Sphinx reads only changed pages again
            page.write_text(text)


def stay_text(app, env, node, contnode):
    """A parameter in single backticks has no page: it stays text."""
    return contnode if node["reftype"] == "obj" and "." not in node["reftarget"] else None


def link_pages(app, what, name, thing, options, lines):
    """The path of a page in a docstring becomes a link."""
    lines[:] = [re.sub(r"docs/((?:filters/)?\w+)\.md", r":doc:`/docs/\1`", line) for line in lines]


def setup(app):
    app.connect("config-inited", lambda app, config: write(GENERATED))
    app.connect("autodoc-process-docstring", link_pages)
    app.connect("missing-reference", stay_text)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
