"""What other tools make of the public benchmark: runs, CPU seconds, and the tables of docs/comparison.md.

The README of the benchmarks says what each command shows.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from operator import itemgetter
from pathlib import Path
from statistics import median
from typing import Annotated

import numpy as np
import typer
from glsk_bench import BenchmarkFolder, Results, make, read_folder, repeat, sample, score, score_answers
from glsk_bench.clouds import cloud
from glsk_bench.scoring import TIMES_NAME, read_times
from glsk_bench.shapes import shape
from glsk_bench.versions import VERSIONS

from glsk_o3d import read_cloud, read_skeleton, save_skeleton
from glsk_o3d.interop.atomic import write_json
from glsk_o3d.interop.clouds import cloud_points

from . import board
from .board import Entry, kept, repeats, seconds
from .peers import PEERS, Peer, installed, one_thread, peers_of, silence, skeleton_of
from .runs import Jobs, application, writable
from .runs import run as in_processes
from .tables import ROOT, fill, machine, markdown, number, read, surroundings

BENCH = "bench"  # the clouds, in the folder that a run is given; beside it a folder of answers for each tool
TIMED = ("clean", "depth2")  # of the first shape of each family
KEPT_AFTER = 20  # skeletons, so that little is lost when a run is stopped
# imported by all processes at once, since that takes longer than some skeletons
PRELOADED = ("glsk_o3d.pipelines", "glsk_o3d.filters.refiner", "glsk_o3d.io.scans", "glsk_o3d.viewing.preview")
PRELOADED += ("glsk_bench.scoring", "glsk_bench.making", "glsk_bench.table", "open3d", "typer", "trimesh", "skeletor")
PRELOADED += ("pc_skeletor", "pygel3d.graph", "compas_cgal.skeletonization", "compas_cgal.meshing", "skan")
PRELOADED += ("glsk_studies.leaderboard",)  # which each process loads anew otherwise
TEN = ("animals_100", "blades_100", "mugs_100", "rings_100", "toys_100")  # shapes of which two clouds each are kept
TEN_VARIANTS = ("depth2", "flying")
IMAGES = ROOT / "docs" / "images"
PARTS = (  # of pages; those of a kind of shapes begin with it
    *("short", "leaderboard", "losses", "failures", "runs", "recorded", "repeat"),
    *(f"{kind}-{part}" for kind in board.KINDS for part in ("leaderboard", "losses", "variants", "families")),
)
PICTURES = {"things": "leaderboard_things", "tubes": "leaderboard"}

app = application(__doc__)
Place = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the clouds and of all answers.")]
Tool = Annotated[str, typer.Option("--tool", metavar="NAMES", help="With commas; else all that are installed.")]
Version = Annotated[str, typer.Option("--version", metavar="NAME", help="Of the benchmark: v3, things, or v1, tubes.")]
Limit = Annotated[float, typer.Option("--limit", help="Seconds for a skeleton.")]


@app.command("run")
def run_(
    place: Place,
    tool: Tool = "",
    limit: Limit = 300.0,
    jobs: Jobs = 2,
    version: Version = "v3",
) -> None:
    """Run tools over all shapes of which benchmarks/VERSION has no scores of the same making, or go on; keep those."""
    peers = installed(peers_of(version), tool)
    bench = make(place / BENCH, version, jobs=jobs)
    for name, made in answered(bench, place, peers, limit, jobs, anew=False):
        keep_scores(bench, place / name, peers[name], made)


@app.command("keep")
def keep_(place: Place, tool: Tool = "") -> None:
    """Keep the scores of what has been run so far, of all shapes that have all their answers."""
    bench = read_folder(place / BENCH)
    for name, peer in installed(PEERS, tool).items():
        if (place / name / TIMES_NAME).is_file():
            keep_scores(bench, place / name, peer, read(place / name / TIMES_NAME)["made"])


@app.command("ten")
def ten_(place: Place, tool: Tool = "cao2010", version: Version = "v3") -> None:
    """Keep a tool's answers to ten clouds, and all digits of their scores, with which scripts/try_wheel.py compares."""
    bench, found = read_folder(place / BENCH), {}
    for each in bench.scored:
        if each.shape in TEN and each.variant in TEN_VARIANTS:
            answer = read_skeleton(place / tool / f"{each.name}.npz")
            vertices, edges = answer.vertices.round(6).tolist(), answer.edges.tolist()
            scores = score(bench.truth(each.shape), vertices, edges).as_dict()
            found[each.name] = dict(vertices=vertices, edges=edges, scores=scores)
    typer.echo(board.keep_ten(version, found))


def keep_scores(bench: BenchmarkFolder, answers: Path, peer: Peer, made: dict) -> None:
    """Score a tool's answers to whole shapes, keep that beside what is kept of the other shapes, and say so."""
    times = read_times(answers)
    lacking = {it.shape for it in bench.scored if it.name not in times}
    there = replace(bench, shapes={shape: told for shape, told in bench.shapes.items() if shape not in lacking})
    before = [row for row in rows_kept(bench.version, answers.name, peer, made) if row["shape"] in lacking]
    rows = before + (score_answers(there, answers).rows if there.shapes else [])
    if not rows:
        typer.echo(f"{answers}: no shape has all its answers yet: nothing is kept")
        return
    whole = bench.whole and lacking == {row["shape"] for row in before}
    results = Results(bench.name, answers.name, whole, sorted(rows, key=itemgetter("shape")))
    typer.echo(f"{board.keep_scores(results, made)}: {results.failures} failures of {len(results.rows)} clouds")


@app.command("repeat")
def repeat_(
    place: Place,
    meshes: Annotated[Path | None, typer.Argument(metavar="MESHES", help="A folder; else things.")] = None,
    tool: Tool = "",
    draws: Annotated[int, typer.Option("--draws", min=2, help="Clouds of each object.")] = 5,
    limit: Limit = 300.0,
    jobs: Jobs = 2,
    version: Version = "v3",
) -> None:
    """Run tools over several clouds of each object, and keep how far their answers are apart in benchmarks/VERSION."""
    objects = "things" if meshes is None else "meshes"
    folder, peers = place / f"repeat_{objects}", installed(peers_of(version), tool)
    bench = sample(folder / BENCH, meshes, version=version, draws=draws, double=True)
    for name, made in answered(bench, folder, peers, limit, jobs):
        found = repeat(bench, folder / name, name=name)
        where = board.keep_repeat(version, objects, found, made)
        moved, failures = (found.means()[it] for it in ("moved", "failures"))
        typer.echo(f"{where}: {name}: moved {number(moved)}, {failures} failures")


def answered(
    bench: BenchmarkFolder, place: Path, peers: Mapping[str, Peer], limit: float, jobs: int, anew: bool = True
) -> Iterator[tuple[str, dict]]:
    """Run tools over all clouds, or go on; gives the name of each, when all are done, and what it was made with.

    Not `anew`: shapes of which scores are kept are left out.
    """
    one_thread()
    known = {name: begun(place / name, peer, limit) for name, peer in peers.items()}
    scored = {
        name: {row["shape"] for row in rows_kept(bench.version, name, peer, known[name][0])} if not anew else set()
        for name, peer in peers.items()
    }
    seeds: dict[int, list] = {}  # first those of all tools and families, so that what is stopped can be compared
    for it in bench.scored:
        seeds.setdefault(bench.shapes[it.shape].get("seed", 0), []).append(it)
    for (_, clouds), (name, peer) in product(sorted(seeds.items()), peers.items()):
        made, times = known[name]
        todo = [it for it in clouds if it.name not in times and it.shape not in scored[name]]
        for first in range(0, len(todo), KEPT_AFTER):
            some = todo[first : first + KEPT_AFTER]
            work = [(dict(cloud=it.name), (it.path, peer, place / name / f"{it.name}.npz")) for it in some]
            for row in in_processes(answer, work, jobs, fresh=True, limit=limit, preload=PRELOADED):
                spent = limit if "not done" in row.get("failure", "") else None
                times[row["cloud"]] = {"seconds": row.get("seconds", spent), "failure": row.get("failure")}
            write_json(place / name / TIMES_NAME, {"made": made, "clouds": times})
    yield from ((name, made) for name, (made, _) in known.items())


def begun(folder: Path, peer: Peer, limit: float) -> tuple[dict, dict]:
    """What a tool's answers are made with, and what is known of those that are there; they must be of the same."""
    folder.mkdir(exist_ok=True)
    made = {**surroundings(), "packages": peer.versions(), "limit": limit}
    if not (folder / TIMES_NAME).is_file():
        return made, {}
    before = read(folder / TIMES_NAME)["made"]
    if other := [f"{before[it]}" for it in making(peer) if before[it] != made[it]]:
        raise typer.BadParameter(f"{folder} has answers of {', '.join(other)}: remove it, or give another folder")
    return before, read_times(folder)


def making(peer: Peer) -> tuple[str, str]:
    """What answers of a tool must have been made with alike to stand in one table."""
    return ("packages", "limit") if peer.packages else ("commit", "limit")


def rows_kept(version: str, name: str, peer: Peer, made: dict) -> list[dict]:
    """The scores in benchmarks/VERSION of a tool's answers, if they were made alike."""
    told = board.read_kept(version, f"{name}.json.gz")
    if not told or any(told["made"][it] != made.get(it) for it in making(peer)):
        return []
    commit = made.get("commit") or "-dirty"  # of ours: what is not committed may be anything
    return [] if commit.endswith("-dirty") and not peer.packages else told["clouds"]


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
def seconds_(tool: Tool = "", version: Version = "v3") -> None:
    """CPU seconds and memory of each tool on the first shapes, kept in benchmarks/VERSION. For an idle Linux."""
    peers, asked, where = installed(peers_of(version), tool), VERSIONS[version], machine()
    shapes = [shape(family, asked.seeds[0], steady=asked.steady) for family in asked.families]
    clouds = [cloud(it, variant) for it in shapes for variant in TIMED if variant in asked.variants_of(it.name)]
    one_thread()
    for name, peer in peers.items():
        (row,) = in_processes(timed, [(dict(tool=name), (peer, clouds))], 1, fresh=True, preload=PRELOADED)
        if "failure" in row:
            typer.echo(f"{name}: {row['failure']}")
            continue
        board.keep_seconds(version, {name: dict(cpu=round(row["cpu"], 3), mb=round(row["mb"]), where=where)})
        typer.echo(f"{name}: {row['cpu']:.2f} s, {row['mb']:.0f} MB")


def timed(peer: Peer, clouds: list[np.ndarray]) -> dict:
    """The median CPU seconds of a tool after a first call, and how many MB all its calls take at most."""
    before = memory("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # so that VmHWM begins anew
    spent = [peer.timed(points)[1] for points in clouds]
    return dict(cpu=median(spent), mb=memory("VmHWM") - before)


def memory(fact: str) -> float:
    """What Linux says of this process [MB]: VmRSS, its memory now, or VmHWM, the most that it had."""
    return int(re.search(rf"{fact}:\s*(\d+)", Path("/proc/self/status").read_text())[1]) / 1024


def parts_of(path: Path) -> list[str]:
    """The tables for which a page has a place."""
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    names = [name for name in PARTS if f"<!-- {name} -->\n" in text]
    if not names:
        raise typer.BadParameter(f"there is no page {path} with a line <!-- NAME -->: {', '.join(PARTS)}")
    return names


@app.command()
def page(paths: Annotated[list[Path] | None, typer.Argument(metavar="MD...")] = None) -> None:
    """The tables of what is kept, printed; or put into pages, with pictures in docs/images."""
    places = {path: parts_of(path) for path in paths or ()}
    entries = {kind: found for kind, version in board.KINDS.items() if (found := kept(version))}
    rows = {kind: board.ranked(here) for kind, here in entries.items()}
    found = pieces(entries, rows)
    if not places:
        typer.echo("\n".join(found.values()))
    for path, names in places.items():
        fill(path, {name: found[name] for name in names if name in found})
    for kind in rows if places else ():
        board.draw_board(rows[kind], IMAGES, PICTURES[kind])


def pieces(entries: Mapping[str, list[Entry]], rows: Mapping[str, list[dict]]) -> dict[str, str]:
    """What stands at the places of the pages, by their names; of what is kept, and the leaderboards' entries."""
    spent = {kind: seconds(board.KINDS[kind]) for kind in entries}
    worse = {kind: board.worse(here) for kind, here in entries.items()}
    found = {"failures": board.failures(entries), "runs": board.runs(entries), "losses": board.losses(worse)}
    if entries.keys() == board.KINDS.keys():
        found["short"] = board.short(rows["things"], rows["tubes"], spent["things"])
        found["leaderboard"] = board.both(rows["things"], rows["tubes"], spent["things"])
    for kind, here in entries.items():
        found |= {
            f"{kind}-leaderboard": board.overview(rows[kind], spent[kind], kind),
            f"{kind}-losses": board.all_losses(worse[kind], kind),
            f"{kind}-variants": board.by_group(here, "variant", kind),
            f"{kind}-families": board.by_group(here, "family", kind),
        }
    if again := repeats(board.KINDS["things"], "things"):
        found["repeat"] = board.repeated(again)
    told = {name: markdown([table]) for name, table in found.items()}
    for kind, each in spent.items():
        where = dict.fromkeys(it["where"] for it in each.values())
        told[f"{kind}-leaderboard"] += "".join(f"\nCPU seconds: {it}\n" for it in where)
    return {**told, "recorded": markdown([board.recorded()])}


@app.command()
def picture(
    place: Place,
    path: Annotated[Path, typer.Argument(metavar="PNG", callback=writable)],
    name: Annotated[str, typer.Option("--cloud", help="One of the benchmark.")] = "figures_100_scan2",
    tool: Tool = "default,pygel-points,cgal,pc-skeletor,cgal-poisson,skeletor-wavefront",
    version: Version = "v3",
) -> None:
    """Draw the answers of some tools to one cloud, side by side."""
    entries = {entry.tool: entry for entry in kept(version)}
    chosen = [entries[it] for it in tool.split(",") if it in entries]
    board.draw_answers(read_folder(place / BENCH), place, name, chosen, path)
