"""The site: built from the root of the repository, so that links between its Markdown files hold here as on GitHub."""

import logging
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs" / "_ext")]
os.environ.setdefault("MPLBACKEND", "Agg")
logging.getLogger("matplotlib.animation").setLevel(logging.WARNING)

import glsk_o3d  # noqa: E402

project = "glsk-o3d"
author = "glsk-o3d contributors"
copyright = author
version = release = glsk_o3d.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "myst_parser",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "sphinxcontrib.bibtex",
    "api",  # these are in _ext
    "keywords",
    "mathml",
    "tables",
]
root_doc = "docs/index"
include_patterns = ["*.md", "docs/**", "benchmarks/README.md", "filters/README.md"]
exclude_patterns = [".*", "build", "dist", "demo", "tests", "glsk_o3d", "examples", "docs/_*", "docs/gallery", "**/.*"]
nitpicky = True
nitpick_ignore = [
    ("py:class", "pymeshlab.pmeshlab.MeshSet"),
    ("py:class", "glsk_o3d.analysis.rows.Rows"),  # of the tables
    ("py:class", "glsk_o3d.data.points.WorkingCloud"),  # of Points and Contraction
    ("py:class", "glsk_o3d.data.space_curve.SpaceCurve"),  # of Skeleton
    ("py:class", "enum.Enum"),
    ("py:obj", "glsk_o3d.pipeline.In"),  # type variables
    ("py:obj", "glsk_o3d.pipeline.Out"),
]
default_role = "autolink"

myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 4
html_math_renderer = "mathml"  # browsers draw MathML themselves: no script, no network

autodoc_typehints = "none"  # the docstrings say more: shapes, dtypes, units
autodoc_member_order = "bysource"
maximum_signature_line_length = 72  # longer ones have a parameter a line
autosummary_generate = False
numpydoc_show_class_members = False
bibtex_bibfiles = ["references.bib"]
bibtex_reference_style = "author_year"
bibtex_default_style = "plain"

sphinx_gallery_conf = dict(
    examples_dirs="docs/gallery",
    gallery_dirs="docs/generated/gallery",
    filename_pattern=r"/plot_",
    abort_on_example_error=True,
    min_reported_time=float("inf"),
    show_memory=False,
    show_signature=False,
    within_subsection_order="FileNameSortKey",
    thumbnail_size=(480, 360),
    remove_config_comments=True,
    write_computation_times=False,
)

smartquotes = False
templates_path = ["_templates"]
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme = "furo"
html_use_index = html_domain_indices = False  # the reference goes by task, and words are searched for
pygments_dark_style = "github-dark"
html_title = f"glsk-o3d {release}"
html_search_scorer = str(ROOT / "docs" / "_static" / "scorer.js")
html_additional_pages = {"index": "index.html"}  # leads to docs/index.html
html_copy_source = html_show_sourcelink = False
html_show_sphinx = html_show_copyright = False
