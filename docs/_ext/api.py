"""The pages of the API reference, one per public name: from the stubs, the lists ``__all__`` and the modules."""

import importlib
import inspect
from pathlib import Path

TASKS = {
    "From a cloud to its skeleton": (
        *("skeletonize", "Skeleton", "Report", "IterationRecord", "Judgement"),
        "remove_redundant_points",
    ),
    "Filters and stopping rules": (
        *("RingBuilder", "Contractor", "LPRReducer", "Connector", "Refiner"),
        *("ExplainedScore", "RingSizeRatio"),
    ),
    "Pipelines, and what runs in them": ("Pipeline", "Filter", "Cloud", "Contraction", "annotate_contraction"),
    "Pipelines as files": ("to_recipe", "from_recipe", "save_recipe", "load_recipe", "rerun"),
    "Reading and writing": (
        *("read_cloud", "read_tensor_cloud", "read_sample", "read_skeleton", "read_truth"),
        *("save_skeleton", "save_cylinders", "save_rig", "save_mesh", "save_tensor_cloud", "annotate_file"),
    ),
    "Looking": ("plot_skeleton", "save_preview", "save_report", "save_assessment", "ContractionRecorder"),
    "In MeshLab's way": ("MeshSet",),
    "Errors and warnings": (
        *("GlskError", "BatchError", "DisplayError", "FileFormatError", "InvalidCloudError", "InvalidParameterError"),
        *("MissingPackageError", "RecipeError", "ScriptError", "StageError", "PluginWarning", "SkeletonWarning"),
    ),
}
"""The names of the package itself, by what they are for."""
PACKAGES = {
    "glsk_o3d": "The package",
    "glsk_o3d.pipelines": "Named pipelines",
    "glsk_o3d.analysis": "Analysis",
    "glsk_o3d.editing": "After the skeleton",
    "glsk_o3d.crosscheck": "Cross-check",
    "glsk_o3d.batch": "Batches",
    "glsk_o3d.samples": "Sample clouds",
    "glsk_o3d.benchmark": "The benchmark",
}
"""What users import from."""
MODULES = {
    "glsk_o3d.io.annotation": "Attributes on clouds",
    "glsk_o3d.io.clouds.selection": "Some of the points",
    "glsk_o3d.io.tubes": "Tubes",
    "glsk_o3d.analysis.skinning": "Skins",
    "glsk_o3d.io.colors": "Colours",
    "glsk_o3d.parameters": "Making filters",
    "glsk_o3d.interop.clouds": "What counts as a cloud",
    "glsk_o3d.recipes": "Comparing runs",
    "glsk_o3d.recipes.catalogue": "What there is by name",
    "glsk_o3d.recipes.plugins": "Plugins",
    "glsk_o3d.meshlab.steps": "Filter scripts",
}
"""What the package's own parts, and those who extend it, import from."""


def names(module):
    """The public functions and classes of a module: those in ``__all__``, or else all that it defines.

    Parameters
    ----------
    module : str

    Returns
    -------
    list of str
    """
    if module == "glsk_o3d":
        return [name for told in TASKS.values() for name in told]
    loaded = importlib.import_module(module)
    own = [name for name, thing in vars(loaded).items() if getattr(thing, "__module__", None) == module]
    found = getattr(loaded, "__all__", [name for name in own if not name.startswith("_")])
    return sorted((name for name in found if callable(getattr(loaded, name))), key=str.lower)


def listed(module, names):
    """Lines of a list of names with the first sentence of each, and for the menu."""
    yield from (f".. currentmodule:: {module}", "", ".. autosummary::", "", *(f"   {name}" for name in names), "")
    yield from (".. toctree::", "   :hidden:", "", *(f"   {module}.{name}" for name in names), "")


def write(folder: Path) -> None:
    """Write ``api/index.rst`` and a page per name."""
    pages, done = {}, {}
    index = ["API reference", "=============", "", "Every public name, from its docstring.", ""]
    for module, title in {**PACKAGES, **MODULES}.items():
        loaded = importlib.import_module(module)
        new = [name for name in names(module) if done.setdefault(id(getattr(loaded, name)), module) == module]
        index += [title, "-" * len(title), "", f".. automodule:: {module}", ""]
        if module == "glsk_o3d":
            for task, told in TASKS.items():
                index += [task, "^" * len(task), "", *listed(module, told)]
        else:
            index += listed(module, new)
        for name in new:
            full, kind = f"{module}.{name}", "class" if inspect.isclass(getattr(loaded, name)) else "function"
            members = "   :members:\n   :show-inheritance:\n" if kind == "class" else ""
            pages[full] = f"{name}\n{'=' * len(name)}\n\n.. currentmodule:: {module}\n.. auto{kind}:: {full}\n{members}"
    pages["index"] = "\n".join(index)
    folder = folder / "api"
    folder.mkdir(parents=True, exist_ok=True)
    for old in set(folder.glob("*.rst")) - {folder / f"{name}.rst" for name in pages}:
        old.unlink()
    for name, text in pages.items():
        page = folder / f"{name}.rst"
        if not page.exists() or page.read_text() != text:  # what has not changed is not read again
            page.write_text(text)
