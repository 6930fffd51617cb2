"""What other tools make of the public benchmark: runs, CPU seconds, and the tables of docs/comparison.md.

The README of the benchmarks says what each command shows.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Annotated

import typer
from glsk_bench import BenchmarkFolder, leaderboard, make, read_folder, repeat, sample, score_answers
from glsk_bench.clouds import cloud
from glsk_bench.scoring import TIMES_NAME, read_times
from glsk_bench.shapes import shape
from glsk_bench.versions import VERSIONS

from glsk_o3d import read_cloud, save_skeleton
from glsk_o3d.interop.atomic import write_json
from glsk_o3d.interop.clouds import cloud_points

from . import board
from .board import Entry, kept, repeats, seconds
from .peers import PEERS, Peer, installed, one_thread, silence, skeleton_of
from .runs import Jobs, application, writable
from .runs import run as in_processes
from .tables import ROOT, Table, fill, machine, markdown, number, read, surroundings

BENCH = "bench"  # the clouds, in the folder that a run is given; beside it a folder of answers for each tool
TIMED = ("clean", "depth2")  # of the first shape of each family
KEPT_AFTER = 20  # skeletons, so that little is lost when a run is stopped
# imported by all processes at once, since that takes longer than some skeletons
PRELOADED = ("glsk_o3d.pipelines", "glsk_o3d.filters.refiner", "glsk_o3d.io.scans", "glsk_o3d.viewing.preview")
PRELOADED += ("glsk_bench.scoring", "glsk_bench.making", "glsk_bench.table", "open3d", "typer", "trimesh", "skeletor")
PRELOADED += ("pc_skeletor", "pygel3d.graph", "compas_cgal.skeletonization", "compas_cgal.meshing", "skan")
PRELOADED += ("glsk_studies.leaderboard",)  # which each process loads anew otherwise
IMAGES = ROOT / "docs" / "images"
PARTS = {  # of pages, by the version of the benchmark
    "v1": (
        *("short", "leaderboard", "losses", "unclear", "topologies", "errors", "families", "failures", "runs"),
        "recorded",
    ),
    "v2": (
        *("things-short", "things-leaderboard", "things-losses", "things-unclear", "things-topologies"),
        *("things-errors", "things-hooks", "things-reach", "things-families", "things-families-hooks"),
        *("things-failures", "things-runs", "things-repeat"),
    ),
}
REPEATED = {"repeat": "things", "repeat-meshes": "meshes"}
PICTURES = {"v1": "leaderboard", "v2": "leaderboard_things"}

app = application(__doc__)
Place = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the clouds and of all answers.")]
Tool = Annotated[str, typer.Option("--tool", metavar="NAMES", help="With commas; else all that are installed.")]
Version = Annotated[str, typer.Option("--version", metavar="NAME", help="Of the benchmark.")]
Limit = Annotated[float, typer.Option("--limit", help="Seconds for a skeleton.")]


@app.command("run")
def run_(
    place: Place,
    tool: Tool = "",
    limit: Limit = 60.0,
    jobs: Jobs = 2,
    version: Version = "v1",
) -> None:
    """Run tools over the whole benchmark, or go on where it was left, and keep their scores in benchmarks/VERSION."""
    peers = installed(PEERS, tool)
    bench = make(place / BENCH, version, jobs=jobs)
    for name, made in answered(bench, place, peers, limit, jobs):
        keep_scores(bench, place / name, made)


@app.command("keep")
def keep_(place: Place, tool: Tool = "") -> None:
    """Keep the scores of what has been run so far, of all shapes that have all their answers."""
    bench = read_folder(place / BENCH)
    for name in installed(PEERS, tool):
        if (place / name / TIMES_NAME).is_file():
            lacking = {it.shape for it in bench.scored if it.name not in read_times(place / name)}
            shapes = {shape: told for shape, told in bench.shapes.items() if shape not in lacking}
            keep_scores(replace(bench, shapes=shapes), place / name, read(place / name / TIMES_NAME)["made"])


def keep_scores(bench: BenchmarkFolder, answers: Path, made: dict) -> None:
    """Score a tool's answers, keep that, and say so."""
    results = score_answers(bench, answers)
    typer.echo(f"{board.keep_scores(results, made)}: {results.failures} failures of {len(results.rows)} clouds")


@app.command("repeat")
def repeat_(
    place: Place,
    meshes: Annotated[Path | None, typer.Argument(metavar="MESHES", help="A folder; else things.")] = None,
    tool: Tool = "",
    draws: Annotated[int, typer.Option("--draws", min=2, help="Clouds of each object.")] = 5,
    limit: Limit = 60.0,
    jobs: Jobs = 2,
    version: Version = "v2",
) -> None:
    """Run tools over several clouds of each object, and keep how far their answers are apart in benchmarks/VERSION."""
    objects = "things" if meshes is None else "meshes"
    folder, peers = place / f"repeat_{objects}", installed(PEERS, tool)
    bench = sample(folder / BENCH, meshes, version=version, draws=draws)
    for name, made in answered(bench, folder, peers, limit, jobs):
        found = repeat(bench, folder / name, name=name)
        where = board.keep_repeat(version, objects, found, made)
        moved, failures = (found.means()[it] for it in ("moved", "failures"))
        typer.echo(f"{where}: {name}: moved {number(moved)}, {failures} failures")


def answered(
    bench: BenchmarkFolder, place: Path, peers: Mapping[str, Peer], limit: float, jobs: int
) -> Iterator[tuple[str, dict]]:
    """Run tools over all clouds, or go on; gives the name of each, when all are done, and what it was made with."""
    one_thread()
    for name, peer in peers.items():
        made, times = begun(place / name, peer, limit)
        todo = [it for it in bench.scored if it.name not in times]
        todo.sort(key=lambda it: bench.shapes[it.shape].get("seed", 0))  # so that a part has shapes of all families
        for first in range(0, len(todo), KEPT_AFTER):
            some = todo[first : first + KEPT_AFTER]
            work = [(dict(cloud=it.name), (it.path, peer, place / name / f"{it.name}.npz")) for it in some]
            for row in in_processes(answer, work, jobs, fresh=True, limit=limit, preload=PRELOADED):
                spent = limit if "not done" in row.get("failure", "") else None
                times[row["cloud"]] = {"seconds": row.get("seconds", spent), "failure": row.get("failure")}
            write_json(place / name / TIMES_NAME, {"made": made, "clouds": times})
        yield name, made


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
def seconds_(tool: Tool = "", version: Version = "v1") -> None:
    """CPU seconds of each tool on twelve clouds, one at a time; kept in benchmarks/VERSION. Let the machine be idle."""
    peers = installed(PEERS, tool)
    where = machine()
    one_thread()
    rows = in_processes(timed, [(dict(tool=name), (peer, version)) for name, peer in peers.items()], 1, fresh=True)
    board.keep_seconds(
        version, {row["tool"]: dict(cpu=round(row["cpu"], 3), where=where) for row in rows if "cpu" in row}
    )
    for row in rows:
        typer.echo(f"{row['tool']}: " + (row["failure"] if "failure" in row else f"{row['cpu']:.2f} s"))


def timed(peer: Peer, version: str) -> dict:
    """The median CPU seconds of a tool, after a first call."""
    asked = VERSIONS[version]
    shapes = [shape(family, asked.seeds[0]) for family in asked.families]
    return dict(cpu=median(peer.timed(cloud(it, variant))[1] for it in shapes for variant in TIMED))


def parts_of(path: Path) -> list[str]:
    """The tables for which a page has a place."""
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    known = [name for names in PARTS.values() for name in names]
    names = [name for name in known if f"<!-- {name} -->\n" in text]
    if not names:
        raise typer.BadParameter(f"there is no page {path} with a line <!-- NAME -->: {', '.join(known)}")
    return names


@app.command()
def page(paths: Annotated[list[Path] | None, typer.Argument(metavar="MD...")] = None) -> None:
    """The tables of what is kept, printed; or put into pages, with pictures in docs/images."""
    places = {path: parts_of(path) for path in paths or ()}
    found = {}
    for version in PARTS:
        entries = kept(version)
        rows = leaderboard(entry.results for entry in entries).entries if entries else []
        found |= pieces(version, entries, rows)
        if rows and places:
            board.draw_board(rows, IMAGES, PICTURES[version])
    if not places:
        typer.echo("\n".join(found.values()))
    for path, names in places.items():
        fill(path, {name: found[name] for name in names if name in found})


def pieces(version: str, entries: list[Entry], rows: list[dict]) -> dict[str, str]:
    """What stands at the places of the pages, by their names; of what is kept, and its leaderboard's entries."""
    found: dict[str, Table] = {}
    if entries:
        cpu, worse = seconds(version), board.worse(entries)
        found = {
            "short": board.short(rows, cpu),
            "leaderboard": board.overview(rows, cpu),
            "losses": board.losses(worse),
            "unclear": board.unclear(worse),
            "topologies": board.by_group(entries, "variant", "topology", 2, "right topology, by kind of cloud"),
            "errors": board.by_group(entries, "variant", "error", 3, "error, by kind of cloud"),
            "hooks": board.by_group(entries, "variant", "hooks", 2, "ends that are hooks, by kind of cloud"),
            "reach": board.by_group(entries, "variant", "reach", 2, "reach, by kind of cloud"),
            "families": board.by_group(entries, "family", "topology", 2, "right topology, by family of shapes"),
            "families-hooks": board.by_group(entries, "family", "hooks", 2, "ends that are hooks, by family"),
            "failures": board.failures(entries),
            "runs": board.runs(entries),
            "recorded": board.recorded(),
        }
    found |= {name: board.repeated(it) for name, objects in REPEATED.items() if (it := repeats(version, objects))}
    prefix = "" if version == "v1" else "things-"
    told = {f"{prefix}{name}": markdown([table]) for name, table in found.items()}
    if entries:
        where = {it["where"]: None for it in cpu.values()}
        told[f"{prefix}leaderboard"] += "".join(f"\nCPU seconds: {it}\n" for it in where)
    return {name: told[name] for name in PARTS[version] if name in told}


@app.command()
def picture(
    place: Place,
    path: Annotated[Path, typer.Argument(metavar="PNG", callback=writable)],
    name: Annotated[str, typer.Option("--cloud", help="One of the benchmark.")] = "figures_100_scan2",
    tool: Tool = "default,pygel-points,cgal,pc-skeletor,cgal-poisson,skeletor-wavefront",
    version: Version = "v1",
) -> None:
    """Draw the answers of some tools to one cloud, side by side."""
    entries = {entry.tool: entry for entry in kept(version)}
    chosen = [entries[it] for it in tool.split(",") if it in entries]
    board.draw_answers(read_folder(place / BENCH), place, name, chosen, path)
