"""One of the other tools on one cloud: what `glsk benchmark run --command` calls, from a file to a file.

The README of the benchmarks says how, docs/comparison.md how each tool is called. No tool is warmed up.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from glsk_o3d import read_cloud, save_skeleton
from glsk_o3d.interop.clouds import cloud_points

from .forest import TOOLS, upright
from .peers import PEERS, installed, one_thread, silence, skeleton_of
from .runs import application

KNOWN = TOOLS | PEERS
"""All tools; those of trees take z for up, and others do not mind."""
app = application(None)


@app.command(help=__doc__)
def main(
    tool: Annotated[str, typer.Argument(metavar="TOOL", help=f"One of {', '.join(KNOWN)}.")],
    cloud: Annotated[Path, typer.Argument(metavar="CLOUD", help="As for glsk skeletonize.")],
    skeleton: Annotated[Path, typer.Argument(metavar="SKELETON", help="Any format of skeletons.")],
    up: Annotated[str, typer.Option("--up", metavar="AXIS", help="That points up, for tools of trees: x, y, z.")] = "z",
) -> None:
    if tool not in KNOWN:
        raise typer.BadParameter(f"no tool {tool}: there are {', '.join(KNOWN)}")
    (peer,) = installed(KNOWN, tool).values()
    turn = upright(up)
    one_thread()
    points = cloud_points(read_cloud(cloud))
    with silence():
        vertices, edges = peer(np.ascontiguousarray(points[:, turn]))
    save_skeleton(skeleton_of(vertices[:, np.argsort(turn)], edges), skeleton)
