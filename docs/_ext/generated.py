"""Writes the API pages from the code before Sphinx reads anything, and mends what docstrings say in plain words."""

import re
from pathlib import Path

import api

GENERATED = Path(__file__).resolve().parents[1] / "generated"


def write(app, config):
    api.write(GENERATED)


def plain(app, env, node, contnode):
    """Single backticks in docstrings are also for parameters, which have no page: these stay words."""
    return contnode if node["reftype"] == "obj" and "." not in node["reftarget"] else None


def link(app, what, name, thing, options, lines):
    """Pages that docstrings name by their path become links."""
    lines[:] = [re.sub(r"docs/((?:filters/)?\w+)\.md", r":doc:`/docs/\1`", line) for line in lines]


def lead_to_pages(app, docname, source):
    """On GitHub a link into the gallery opens a script; here it leads to the page with its pictures."""
    here = "../" * docname.count("/") + "docs/generated/gallery/"
    told = source[0].replace("](gallery/README.rst)", f"]({here}index.rst)")
    source[0] = re.sub(r"\]\(gallery/(plot_\w+)\.py\)", rf"]({here}\1.rst)", told)


def setup(app):
    app.connect("source-read", lead_to_pages)
    app.connect("autodoc-process-docstring", link)
    app.connect("missing-reference", plain)
    app.connect("config-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
