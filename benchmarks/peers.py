"""How skeletons compare with those of other tools, on shapes with known axes.

python benchmarks/peers.py --builtin

The README beside this file says what it shows, docs/comparison.md how each tool is called.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from _common.clouds import Case, cases
from _common.command_line import Folder, Jobs, Markdown, Output, Own, Shapes, Variants, writable
from _common.results import machine, pick, save, summary
from _common.runs import run
from _common.tables import Tables, fill, markdown_table, number, page_with, present
from _peers import PEERS, Peer, installed, one_thread, versions

from glsk_o3d import plot_skeleton
from glsk_o3d.analysis import compare
from glsk_o3d.interop.atomic import write_atomically

EVERY = "clean_4096,noise1_4096,scan2_4096,outliers_4096"
DRAWN = Case("sauropod", "scan2_4096")
DRAWN_BY = ("default", "pc-skeletor", "pygel-points", "cgal", "skeletor-contraction", "thinning-poisson")


# ---------------------------------------------------------------------------------------------------------------- runs


def measure(case: Case, peer: Peer, drawn: bool = False) -> dict:
    """One skeleton against its axis, and the skeleton too if it is to be drawn."""
    points, truth = case.load()
    skeleton, cpu = peer.timed(points)
    found = dict(cpu=cpu, vertices=len(skeleton.vertices)) | compare(skeleton, truth).as_dict()
    return found | dict(skeleton=skeleton) if drawn else found


def measured(known: list[dict], found: list[Case], peers: dict[str, Peer], keep: Callable, **options) -> list[dict]:
    """The rows that are known and those that were not, kept after each variant; options as for `run`."""
    done = {(row["tool"], row["variant"], row["shape"]) for row in known}
    rows = [*known]
    for variant in dict.fromkeys(case.variant for case in found):
        work = [
            (dict(tool=name, **case.facts), (case, peer))
            for case in found
            for name, peer in peers.items()
            if case.variant == variant and (name, variant, case.shape) not in done
        ]
        rows += run(measure, work, **options)
        keep(rows)
    order = list(PEERS)
    return sorted(rows, key=lambda row: order.index(row["tool"]))


# -------------------------------------------------------------------------------------------------------------- tables


def tables(rows: list[dict]) -> Tables:
    """All at a glance, and then a table for each variant."""
    variants, tools = (list(dict.fromkeys(row[key] for row in rows)) for key in ("variant", "tool"))
    size = {name: len({row["shape"] for row in pick(rows, variant=name)}) for name in variants}
    header = ["", "takes", *(f"{name} ({size[name]})" for name in variants), "CPU s"]
    lines = []
    for tool in tools:
        parts = [summary(pick(rows, variant=name, tool=tool)) for name in variants]
        cells = [f"{number(part['error'])} / {part['right']}" for part in parts]
        lines.append([PEERS[tool].label, PEERS[tool].takes, *cells, number(parts[0]["cpu"], 2)])
    found = [("error / right topology", header, lines)]
    header = ["", "takes", "error", "inside", "complete", "topology", "leaves", "CPU s", "failed"]
    for name in variants:
        lines = []
        for tool in tools:
            here = pick(rows, variant=name, tool=tool)
            part = summary(here)
            means = [number(part[key]) for key in ("error", "inside", "completeness")]
            counts = [f"{part[key]}/{size[name]}" for key in ("right", "leaves")]
            cells = [*means, *counts, number(part["cpu"], 2), failed(here)]
            lines.append([PEERS[tool].label, PEERS[tool].takes, *cells])
        found.append((name, header, lines))
    return found


def failed(rows: list[dict]) -> str:
    """Which failed, and how."""
    return ", ".join(f"{row['shape']} ({row['failure']})" for row in rows if "failure" in row)


# ------------------------------------------------------------------------------------------------------------- picture


def draw(rows: list[dict], path: Path) -> None:
    """Skeletons of one cloud side by side, each with its error and what is wrong with its topology."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    points, _ = DRAWN.load()
    columns = min(3, len(rows))
    lines = -(-len(rows) // columns)
    figure = Figure((3.4 * columns, 2.7 * lines), dpi=150, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    for i, row in enumerate(rows):
        axes = figure.add_subplot(lines, columns, i + 1, projection="3d")
        plot_skeleton(row.get("skeleton"), axes, cloud=points, view=(14, -60))
        axes.set_title(caption(row), fontsize=9, y=0.97)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[:, :, :3]
    image = Image.fromarray(pixels).quantize(32)  # a fifth of the size of a figure's
    write_atomically(path, lambda temporary: image.save(temporary, "PNG", optimize=True))


def caption(row: dict) -> str:
    """What stands above a skeleton."""
    peer = PEERS[row["tool"]]
    label = f"{peer.label.strip('`')} ({peer.takes})"
    if "failure" in row:
        return f"{label}\n{row['failure']}"
    off = ", ".join(f"{name} {row[name]:+d}" for name in ("components", "loops") if row[name])
    return f"{label}\nerror {row['error']:.2f}, {off or 'right topology'}"


# ------------------------------------------------------------------------------------------------------------- command


app = typer.Typer(pretty_exceptions_enable=False, rich_markup_mode=None, add_completion=False)


@app.command(help=__doc__)
def main(
    folder: Folder = None,
    own: Own = False,
    tool: Annotated[str, typer.Option("--tool", metavar="NAMES", help="With commas; else all installed.")] = "",
    variant: Variants = EVERY,
    shapes: Shapes = "",
    limit: Annotated[
        float, typer.Option("--limit", help="Seconds for a skeleton, imports included; 0 for any.")
    ] = 60.0,
    jobs: Jobs = 2,
    page: Annotated[
        Path | None,
        typer.Option(
            "--page", metavar="MD", help="Put the tables into this page.", callback=page_with("builtin", "folder")
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="PNG", help="Draw some, side by side.", callback=writable)
    ] = None,
    earlier: Annotated[
        list[Path] | None, typer.Option("--from", metavar="JSON", help="Results of -o that are not measured again.")
    ] = None,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    peers = installed(PEERS, tool)
    found = cases(folder, own, variant, shapes)
    where = f"{machine()} {versions(peers.values())}."  # now, since writing the page changes the working tree
    one_thread()
    known = [row for path in earlier or () for row in json.loads(path.read_text(encoding="utf-8"))["rows"]]
    options = dict(processes=jobs, fresh=True, limit=limit or None)
    # kept as far as it has come: what is stopped can go on with --from
    shown = tables(measured(known, found, peers, partial(save, output), **options))
    if picture is not None:
        work = [(dict(tool=name), (DRAWN, peers[name], True)) for name in DRAWN_BY if name in peers]
        draw(run(measure, work, **options), picture)
    if page is not None:
        body = "\n".join([where, "", *(markdown_table(*table) for table in shown)])
        fill(page, {"builtin" if own else "folder": body})
    present(shown, markdown, where)


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "Agg")
    app()
