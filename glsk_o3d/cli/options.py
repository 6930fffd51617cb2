"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

SKELETON_ENDINGS = ["ply", "obj", "json", "npz", "swc", "graphml", "cgal", "polylines.txt"]
SKELETON_ENDINGS += ["vtp", "dxf", "glb", "mtg", "plant.csv", "urdf"]
"""Endings of skeletons; written out, since the table of formats is slow to import."""

TREE_ENDINGS = ["swc", "glb", "mtg", "plant.csv", "urdf"]
"""Endings of formats that hold only trees."""
ROOT_WORDS = "x to -z for the lowest along an axis, thickest, the number of a vertex, or a point near one, x,y,z"
"""What may follow ``--root``, in all commands."""

SKELETON_FILE = "A skeleton in a file: json, npz, ply, obj, swc, graphml, cgal or polylines.txt."

Where = Annotated[
    str | None,
    typer.Option(
        "--where",
        metavar="CONDITION",
        help="Take only points for which this holds, such as 'classification == 5'; 'glsk info' lists what a file has.",
    ),
]
Output = Annotated[
    list[Path] | None,
    typer.Option(
        "--output",
        "-o",
        metavar="FILE",
        help=f"Where to write the skeleton: {', '.join(SKELETON_ENDINGS)}, by the ending; may be repeated.",
    ),
]
Preview = Annotated[Path | None, typer.Option("--preview", metavar="PNG", help="Also draw cloud and skeleton.")]
ReportPage = Annotated[
    Path | None,
    typer.Option(
        "--report", metavar="HTML", help="Also write a page to look at: turn, zoom, watch the contraction, read."
    ),
]
CutLoops = Annotated[
    bool,
    typer.Option("--cut-loops", help=f"Cut loops open for formats that hold only trees ({', '.join(TREE_ENDINGS)})."),
]
PipelineName = Annotated[
    str,
    typer.Option(
        "--pipeline",
        metavar="NAME",
        help="One of default, tree, wen2024 and cao2010, or a plugin's; 'glsk filters' says what they are.",
    ),
]
Recipe = Annotated[
    Path | None,
    typer.Option("--recipe", metavar="FILE", help="Run a pipeline from a json or toml file instead of a named one."),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="[FILTER.]PARAMETER=VALUE",
        help="Change a parameter, such as Connector.radius=2%, or k=24 where only one filter has a k; may be repeated. "
        "See 'glsk filters'.",
    ),
]
DropInvalid = Annotated[bool, typer.Option("--drop-invalid", help="Drop points with NaN or infinite coordinates.")]
Root = Annotated[
    str | None,
    typer.Option(
        "--root",
        metavar="ROOT",
        help=f"Where the skeleton grows from: {ROOT_WORDS}. By default, where it was made to grow from, or else its "
        "part with the most volume.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON on stdout instead of tables.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors (and JSON, if asked for).")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Also print each iteration, the log, and tracebacks.")]


def root_place(text: str | None) -> int | str | None:
    """What ``--root`` says, as `refinement.rooted.root_among` takes it: the number of a vertex, or words."""
    return int(text) if text is not None and text.isdecimal() and len(text) < 19 else text
