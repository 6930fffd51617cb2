"""What other tools make of the public benchmark: runs, CPU seconds, and the tables of docs/comparison.md.

The README beside this file says what each command shows.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from statistics import median
from typing import Annotated

import _leaderboard as tables
import typer
from _leaderboard import SECONDS, Entry, kept, seconds
from _peers import PEERS, Peer, installed, one_thread, silence, skeleton_of
from _runs import application, writable
from _runs import run as in_processes
from _tables import ROOT, fill, machine, markdown_table, read, surroundings
from glsk_bench import leaderboard, make, read_folder, score_answers
from glsk_bench.clouds import cloud
from glsk_bench.scoring import TIMES_NAME, read_times
from glsk_bench.shapes import FAMILIES, shape

from glsk_o3d import read_cloud, save_skeleton
from glsk_o3d.interop.atomic import write_json
from glsk_o3d.interop.clouds import cloud_points

BENCH = "bench"  # the clouds, in the folder that a run is given; beside it a folder of answers for each tool
TIMED = [(family, variant) for family in FAMILIES["v1"] for variant in ("clean", "depth2")]  # with the seed 100
KEPT_AFTER = 20  # skeletons, so that little is lost when a run is stopped
PRELOADED = (  # by all processes at once, since imports take longer than some skeletons
    *("glsk_o3d.pipelines", "glsk_bench.scoring", "glsk_bench.making", "glsk_bench.table"),
    *("glsk_o3d.refiner", "glsk_o3d.io.scans", "glsk_o3d.viewing.preview", "open3d", "typer", "trimesh", "skeletor"),
    *("pc_skeletor", "pygel3d.graph", "compas_cgal.skeletonization", "compas_cgal.meshing", "skan"),
)
IMAGES = ROOT / "docs" / "images"
PARTS = (
    *("short", "leaderboard", "losses", "unclear", "topologies", "errors", "families", "failures", "runs"),
    "recorded",
)

app = application(__doc__)
Place = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the clouds and of all answers.")]
Tool = Annotated[str, typer.Option("--tool", metavar="NAMES", help="With commas; else all that are installed.")]


@app.command("run")
def run_(
    place: Place,
    tool: Tool = "",
    limit: Annotated[float, typer.Option("--limit", help="Seconds for a skeleton.")] = 60.0,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Processes at once.")] = 2,
    retry: Annotated[bool, typer.Option("--retry", help="Run again what failed.")] = False,
) -> None:
    """Run tools over the whole benchmark, or go on where it was left, and keep their scores in benchmarks/v1."""
    peers = installed(PEERS, tool)
    bench = make(place / BENCH, jobs=jobs)
    one_thread()
    for name, peer in peers.items():
        made, times = begun(place / name, peer, limit)
        todo = [it for it in bench.scored if it.name not in times or (retry and times[it.name]["failure"])]
        for first in range(0, len(todo), KEPT_AFTER):
            some = todo[first : first + KEPT_AFTER]
            work = [(dict(cloud=it.name), (it.path, peer, place / name / f"{it.name}.npz")) for it in some]
            for row in in_processes(answer, work, jobs, fresh=True, limit=limit, preload=PRELOADED):
                spent = limit if "not done" in row.get("failure", "") else None
                times[row["cloud"]] = {"seconds": row.get("seconds", spent), "failure": row.get("failure")}
            write_json(place / name / TIMES_NAME, {"made": made, "clouds": times})
        results = score_answers(bench, place / name, name=name)
        typer.echo(f"{tables.keep_scores(results, made)}: {results.failures} failures")


def begun(folder: Path, peer: Peer, limit: float) -> tuple[dict, dict]:
    """What a tool's answers are made with, and what is known of those that are there; they must be of the same."""
    folder.mkdir(exist_ok=True)
    made = {**surroundings(), "packages": peer.versions(), "limit": limit}
    if not (folder / TIMES_NAME).is_file():
        return made, {}
    before = read(folder / TIMES_NAME)["made"]
    same = ("packages", "limit") if peer.packages else ("commit", "limit")
    if other := [f"{before[it]}" for it in same if before[it] != made[it]]:
        raise typer.BadParameter(f"{folder} has answers of {', '.join(other)}: remove it, or give another folder")
    return before, read_times(folder)


def answer(cloud: Path, peer: Peer, path: Path) -> dict:
    """Write the skeleton of a cloud, nothing said; gives the seconds."""
    points = cloud_points(read_cloud(cloud))
    start = time.perf_counter()
    with silence():
        vertices, edges = peer(points)
    seconds = time.perf_counter() - start
    save_skeleton(skeleton_of(vertices, edges), path)
    return dict(seconds=round(seconds, 3))


@app.command("seconds")
def seconds_(tool: Tool = "") -> None:
    """CPU seconds of each tool on twelve clouds, one at a time; kept in benchmarks/v1. The machine should be idle."""
    peers = installed(PEERS, tool)
    where = machine()
    one_thread()
    rows = in_processes(timed, [(dict(tool=name), (peer,)) for name, peer in peers.items()], 1, fresh=True)
    found = seconds() | {row["tool"]: dict(cpu=round(row["cpu"], 3), where=where) for row in rows if "cpu" in row}
    write_json(SECONDS, found)
    for row in rows:
        typer.echo(f"{row['tool']}: " + (row["failure"] if "failure" in row else f"{row['cpu']:.2f} s"))


def timed(peer: Peer) -> dict:
    """The median CPU seconds of a tool, after a first call."""
    clouds = [cloud(shape(family, 100), variant) for family, variant in TIMED]
    return dict(cpu=median(peer.timed(points)[1] for points in clouds))


def parts_of(path: Path) -> list[str]:
    """The tables for which a page has a place."""
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    names = [name for name in PARTS if f"<!-- {name} -->\n" in text]
    if not names:
        raise typer.BadParameter(f"there is no page {path} with a line <!-- NAME -->: {', '.join(PARTS)}")
    return names


@app.command()
def page(paths: Annotated[list[Path] | None, typer.Argument(metavar="MD...")] = None) -> None:
    """The tables of the scores that are kept, printed; or put into pages, with a picture in docs/images."""
    places = {path: parts_of(path) for path in paths or ()}
    entries = kept()
    rows = leaderboard(entry.results for entry in entries).entries
    found = pieces(entries, rows)
    if not places:
        typer.echo("\n".join(found.values()))
        return
    for path, names in places.items():
        fill(path, {name: found[name] for name in names})
    tables.draw_board(rows, IMAGES)


def pieces(entries: list[Entry], rows: list[dict]) -> dict[str, str]:
    """What stands at the places of the pages, by their names; of what is kept, and its leaderboard's entries."""
    cpu, worse = seconds(), tables.worse(entries)
    found = {
        "short": tables.short(rows, cpu),
        "leaderboard": tables.overview(rows, cpu),
        "losses": tables.losses(worse),
        "unclear": tables.unclear(worse),
        "topologies": tables.by_group(entries, "variant", "topology", 2, "right topology, by kind of cloud"),
        "errors": tables.by_group(entries, "variant", "error", 3, "error, by kind of cloud"),
        "families": tables.by_group(entries, "family", "topology", 2, "right topology, by family of shapes"),
        "failures": tables.failures(entries),
        "runs": tables.runs(entries),
        "recorded": tables.recorded(),
    }
    told = {name: markdown_table(*table) for name, table in found.items()}
    told["leaderboard"] += "".join(f"\nCPU seconds: {where}\n" for where in {it["where"]: None for it in cpu.values()})
    return told


@app.command()
def picture(
    place: Place,
    path: Annotated[Path, typer.Argument(metavar="PNG", callback=writable)],
    name: Annotated[str, typer.Option("--cloud", help="One of the benchmark.")] = "figures_100_scan2",
    tool: Tool = "default,pygel-points,cgal,pc-skeletor,cgal-poisson,skeletor-wavefront",
) -> None:
    """Draw the answers of some tools to one cloud, side by side."""
    entries = {entry.tool: entry for entry in kept()}
    tables.draw_answers(
        read_folder(place / BENCH), place, name, [entries[it] for it in tool.split(",") if it in entries], path
    )


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "Agg")
    app()
