"""Writes the API pages from the code before Sphinx reads anything."""

from pathlib import Path

import api

GENERATED = Path(__file__).resolve().parents[1] / "generated"


def write(app, config):
    api.write(GENERATED)


def plain(app, env, node, contnode):
    """Single backticks in docstrings are also for parameters, which have no page: these stay words."""
    return contnode if node["reftype"] == "obj" and "." not in node["reftarget"] else None


def setup(app):
    app.connect("missing-reference", plain)
    app.connect("config-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
