"""The pages of the API reference, one per public name: from the stubs, the lists ``__all__`` and the modules."""

import importlib
import inspect
from pathlib import Path

PACKAGES = {
    "glsk_o3d": "The package",
    "glsk_o3d.analysis": "Analysis",
    "glsk_o3d.batch": "Batches",
}
"""Packages that list their names."""
MODULES = {
    "glsk_o3d.pipelines": "Named pipelines",
    "glsk_o3d.parameters": "Making filters",
    "glsk_o3d.recipes.catalogue": "What there is by name",
    "glsk_o3d.recipes": "Recipes",
    "glsk_o3d.recipes.plugins": "Plugins",
    "glsk_o3d.samples": "Sample clouds",
    "glsk_o3d.io.annotation": "Attributes on clouds",
    "glsk_o3d.io.tubes": "Tubes",
    "glsk_o3d.io.colors": "Colours",
    "glsk_o3d.interop.clouds": "What counts as a cloud",
    "glsk_o3d.meshlab.steps": "Filter scripts",
}
"""Modules whose functions and classes are all public but for those with an underscore."""


def names(module):
    """The public names of a module or package, modules left out.

    Parameters
    ----------
    module : str

    Returns
    -------
    list of str
    """
    loaded = importlib.import_module(module)
    if module in PACKAGES:
        found = [*loaded.__all__, *(["MeshSet"] if module == "glsk_o3d" else [])]
    else:
        found = [name for name, thing in vars(loaded).items() if getattr(thing, "__module__", None) == module]
    found = [name for name in found if not name.startswith("_")]
    return sorted((name for name in found if not inspect.ismodule(getattr(loaded, name))), key=str.lower)


def write(folder: Path) -> None:
    """Write ``api/index.rst`` and a page per name."""
    pages, done = {}, {}
    index = ["API reference", "=============", "", "Every public name, from its docstring.", ""]
    for module, title in {**PACKAGES, **MODULES}.items():
        loaded = importlib.import_module(module)
        new = [name for name in names(module) if done.setdefault(id(getattr(loaded, name)), module) == module]
        index += [title, "-" * len(title), "", f".. automodule:: {module}", "", ".. autosummary::", ""]
        index += [*(f"   {name}" for name in new), "", ".. toctree::", "   :hidden:", ""]
        index += [*(f"   {module}.{name}" for name in new), ""]
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
