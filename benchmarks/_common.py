"""What the benchmarks share: clouds with known axes, parallel runs, tables, and a file of results."""

from __future__ import annotations

import json
import os
import platform
import re
import signal
import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any
from zipfile import BadZipFile

import numpy as np
import open3d as o3d
import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.spatial import cKDTree

from glsk_o3d import Contractor, Pipeline, pipelines, read_truth, samples
from glsk_o3d.analysis import Truth
from glsk_o3d.cli.overrides import override
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.interop.writing import write_atomically
from glsk_o3d.recipes.catalogue import named_pipeline
from glsk_o3d.report import Report

ROOT = Path(__file__).resolve().parents[1]
HOLES = 6  # in a built-in cloud with holes, each of them as far across as the part it is in
SHOWN = 0.98  # least share of the true axis that a cloud must show for its skeleton to be scored
# columns that are not numbers, besides the first
TEXT = {"pipeline", "setting", "takes", "worst", "wrong", "failed", "note"}

# ------------------------------------------------------------------------------------------------------------- clouds

BUILTIN: dict[str, Callable[..., samples.Sample]] = {
    "tube": samples.tube,
    "thin_tube": partial(samples.tube, radius=0.04),
    "y_junction": samples.y_junction,
    "uneven_y": partial(samples.y_junction, radii=(0.12, 0.06, 0.04), angle=130.0),
    "torus": samples.torus,
    "thin_torus": partial(samples.torus, radius=0.05),
    "two_rings": samples.two_rings,
    "helix": samples.helix,
    "sauropod": partial(samples.sauropod, cameras=None),
}
"""Samples of the package that have an axis, as whole surfaces."""
BUILTIN_VARIANT = re.compile(r"(clean|density|holes|outliers|scan(?=2_)|noise(?=\d))(\d*)_(\d+)")
CAMERAS = np.array([[1, -2, 2], [-1, 2, 2]]) / 3  # where from a built-in scan is taken; nothing is hidden from both


@dataclass(frozen=True)
class Case:
    """A cloud with a known axis: a shape of a folder, or a built-in one (no folder), in some state of disrepair."""

    shape: str
    variant: str
    folder: Path | None = None

    def load(self) -> tuple[np.ndarray, Truth]:
        """The points and the axis."""
        if self.folder is None:
            return builtin(self.shape, self.variant)
        path = self.folder / f"{self.shape}.npz"
        with np.load(path) as archive:
            return archive[self.variant].astype(float), read_truth(path)


def builtin(shape: str, variant: str) -> tuple[np.ndarray, Truth]:
    """A built-in shape as KIND_SIZE: clean, density, holes, outliers, scan2, or noise with its percentage."""
    found = BUILTIN_VARIANT.fullmatch(variant)
    if found is None:
        raise ValueError(
            f"{variant}: built-in variants are clean_N, density_N, holes_N, outliers_N, scan2_N and noiseP_N"
        )
    kind, percent, n = found[1], int(found[2] or 0), int(found[3])
    rng = np.random.default_rng(1)
    # the points of a sample are independent, so that the first n of those kept are a fair choice
    more, noise = 10 if kind in ("density", "holes", "scan") else 1, percent / 100 if kind == "noise" else 0.0
    drawn = BUILTIN[shape](more * n, noise=noise)
    points, kept = drawn.points, np.ones(len(drawn.points), bool)
    if kind == "density":  # ten times as dense at one end as at the other
        along = points[:, np.ptp(points, axis=0).argmax()]
        kept = rng.random(len(points)) < 10 ** ((along - along.min()) / np.ptp(along) - 1)
    elif kind == "holes":
        centres = points[rng.choice(len(points), HOLES)]
        widths = drawn.radii[cKDTree(drawn.nodes).query(centres)[1]]
        kept = (np.linalg.norm(points[:, None] - centres, axis=2) > widths).all(axis=1)
    elif kind == "scan":
        kept = _seen(points)
    elif kind == "outliers":
        points = points.copy()
        points[: n // 100] = rng.uniform(points.min(axis=0), points.max(axis=0), (n // 100, 3))
    return points[kept][:n], Truth(drawn.nodes, drawn.edges, drawn.radii)


def _seen(points):
    """Which points one of the two cameras sees."""
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    size, seen = np.linalg.norm(np.ptp(points, axis=0)), np.zeros(len(points), bool)
    for camera in cloud.get_axis_aligned_bounding_box().get_center() + 2 * size * CAMERAS:
        seen[cloud.hidden_point_removal(camera, 1000 * size)[1]] = True
    return seen


def cases(folder: Path | None, own: bool, variants: str, shapes: str = "") -> list[Case]:
    """What a command is to run on; what there is not, or the manifest says not to score, is left out, and said so.

    Parameters
    ----------
    folder : Path, optional
        Else $GLSK_TRUTH, else the folder shared/truth beside the repository.
    own : bool
        The built-in shapes instead.
    variants : str
        Names with commas.
    shapes : str
        Names with commas, a number for so many of all kinds, or empty for all.
    """
    if own:
        folder, known = None, {name: {} for name in BUILTIN}
    else:
        folder = folder_or(folder, "GLSK_TRUTH", "shared/truth")
        known = _shapes(folder)
    names = shapes.split(",") if shapes else list(known)
    if shapes.isdecimal():
        spread = np.linspace(0, len(known) - 1, min(int(shapes), len(known)))
        names = [list(known)[i] for i in spread.round().astype(int)]
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        raise typer.BadParameter(f"no shape {', '.join(unknown)}: there are {', '.join(known) or 'none'}")
    wanted = [Case(name, variant, folder) for variant in variants.split(",") for name in names]
    there = [case for case in wanted if _offered(case, known[case.shape])]
    if not there:
        raise typer.BadParameter(f"no such variants: {variants}")
    for variant, count in Counter(case.variant for case in wanted if case not in there).items():
        typer.echo(f"left out: {variant} of {count} shapes", err=True)
    return there


def named(names: str) -> dict[str, Pipeline]:
    """The pipelines of these names, with commas."""
    try:
        return {name: named_pipeline(name) for name in names.split(",")}
    except InvalidParameterError as error:
        raise typer.BadParameter(str(error)) from None


def with_solves(pipeline: Pipeline, n: int) -> Pipeline:
    """The pipeline with exactly n solves, fewer only where one is refused."""
    if n == 0:
        return Pipeline(*(stage for stage in pipeline.stages if not isinstance(stage, Contractor)))
    at_once = ["Contractor.stop=ExplainedScore", "ExplainedScore.threshold=1e9", f"ExplainedScore.min_iterations={n}"]
    return override(pipeline, at_once)


def pick(rows: list[dict], **facts) -> list[dict]:
    """The rows with these facts."""
    return [row for row in rows if all(row[name] == value for name, value in facts.items())]


def folder_or(folder: Path | None, variable: str, beside: str) -> Path:
    """The folder if given, else that of an environment variable, else the one beside the repository."""
    folder = folder or Path(os.environ.get(variable, ROOT.parent / beside))
    if not folder.is_dir():
        raise typer.BadParameter(f"there is no folder {folder}: name one, or set {variable}")
    return folder


def _shapes(folder: Path) -> dict[str, dict[str, float]]:
    """Shapes with a meaningful skeleton, and how much of each of their axes a variant's cloud shows."""
    if not (folder / "manifest.json").exists():
        return {path.stem: {} for path in sorted(folder.glob("*.npz"))}
    shapes = json.loads((folder / "manifest.json").read_text())["shapes"]
    return {shape["name"]: shape.get("coverage", {}) for shape in shapes if shape["meaningful_skeleton"]}


def _offered(case: Case, coverage: dict[str, float]) -> bool:
    if case.folder is None:
        return BUILTIN_VARIANT.fullmatch(case.variant) is not None
    try:
        with np.load(case.folder / f"{case.shape}.npz") as archive:
            return case.variant in archive.files and coverage.get(case.variant, 1.0) >= SHOWN
    except (OSError, ValueError, BadZipFile):
        return True  # its row will say what is wrong with the file


# --------------------------------------------------------------------------------------------------------------- runs

DEATHS = {it.value: it.name for it in signal.Signals} | {signal.SIGKILL.value: "killed, perhaps for want of memory"}


def run(
    work: Callable[..., dict],
    jobs: Sequence[tuple[dict, tuple]],
    processes: int,
    fresh: bool = False,
    limit: float | None = None,
) -> list[dict]:
    """Work through jobs in parallel.

    Parameters
    ----------
    work : callable
        A function of a module; gives what it measured.
    jobs : sequence of (facts, arguments)
    processes : int
        At once; 0 for none but this one.
    fresh : bool
        Each job in a process of its own, in which nothing but the warm-up has run, and whose death is a failure of that
        job alone.
    limit : float, optional
        How long such a process may take, everything included [s]; one that takes longer is ended, and has failed.

    Returns
    -------
    list of dict
        One row per job: its facts and what `work` measured, or a `failure` in words.
    """
    if processes == 0:
        with warnings.catch_warnings():
            _warm_up()
            return [_row(work, job) for job in jobs]
    # CPU seconds are those of one thread: NumPy reads this when it is imported, which is in the processes yet to start
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    pool = ThreadPoolExecutor(processes) if fresh else ProcessPoolExecutor(processes, get_context("spawn"), _warm_up)
    with pool:
        rows = pool.map(partial(_alone, limit, work) if fresh else partial(_row, work), jobs)
        return list(track(rows, "", len(jobs), console=Console(stderr=True), transient=True))


def _warm_up() -> None:
    warnings.simplefilter("ignore")  # what a skeleton warns of shows in its measures
    pipelines.default()(samples.tube(256).points)  # loads what is imported when first needed, so that it is not timed


def _alone(limit, work, job):
    context = get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(sender, work, job), daemon=True)
    process.start()
    sender.close()  # so that the end of the process is the end of the pipe
    try:
        if not receiver.poll(limit):
            return job[0] | {"failure": f"not done after {limit:g} s"}
        row = receiver.recv()
        process.join(10)  # let it tidy up
        return row
    except EOFError:
        process.join()
        code = process.exitcode
        return job[0] | {"failure": f"its process died: {DEATHS.get(-code, f'exit code {code}')}"}
    finally:
        process.kill()
        process.join()


def _send(sender, work, job):
    _warm_up()
    sender.send(_row(work, job))


def _row(work, job):
    facts, arguments = job
    try:
        return facts | work(*arguments)
    except Exception as error:  # whatever it is, the other shapes are to be measured
        return facts | {"failure": f"{type(error).__name__}: {error}"}


# ------------------------------------------------------------------------------------------------------------- results


def writable(path: Path | None) -> Path | None:
    if path is not None and not path.absolute().parent.is_dir():  # found out now, not after an hour
        raise typer.BadParameter(f"there is no folder {path.parent}")
    return path


Folder = Annotated[Path | None, typer.Argument(metavar="DIR", help="Folder of shapes, as the README describes it.")]
Own = Annotated[bool, typer.Option("--builtin", help="The package's own samples instead of a folder.")]
Variants = Annotated[str, typer.Option("--variant", metavar="NAMES", help="KIND_SIZE, with commas.")]
Shapes = Annotated[str, typer.Option("--shapes", metavar="NAMES", help="With commas, or how many; else all.")]
Pipelines = Annotated[str, typer.Option("--pipeline", metavar="NAMES", help="With commas.")]
Jobs = Annotated[int, typer.Option("--jobs", min=0, help="Processes; 0 stays in this one, for a debugger.")]
Output = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="JSON", help="Write every result.", callback=writable)
]
Tables = list[tuple[str, list[str], list[list[str]]]]  # title, header, lines
Markdown = Annotated[bool, typer.Option("--markdown", help="Print Markdown.")]


def show(title: str, header: list[str], rows: list[list[str]], markdown: bool) -> None:
    """Print a table of words; the columns in `TEXT` and the first lean left, the numbers right."""
    if markdown:
        typer.echo(markdown_table(title, header, rows))
        return
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False, header_style="")
    for name, numbers in zip(header, _numbers(header), strict=True):
        table.add_column(name, justify="right" if numbers else "left", no_wrap=name not in TEXT)
    for cells in rows:
        table.add_row(*cells)
    console = Console(width=None if sys.stdout.isatty() else 180, markup=False, highlight=False, emoji=False)
    with console.capture() as captured:
        console.print(table)
    typer.echo("\n".join(line.rstrip() for line in captured.get().splitlines()))


def markdown_table(title: str, header: list[str], rows: list[list[str]]) -> str:
    """The same in Markdown."""
    line = ["--:" if numbers else "---" for numbers in _numbers(header)]
    lines = ["| " + " | ".join(cells) + " |" for cells in (header, line, *rows)]
    return "\n".join([f"**{title}**", "", *lines, ""])


def _numbers(header):
    return [i > 0 and name not in TEXT for i, name in enumerate(header)]


def fill(page: Path, parts: Mapping[str, Tables | str], check: bool = False) -> None:
    """Put tables, or texts, into a page between the lines ``<!-- NAME -->`` and ``<!-- end -->``; or only look."""
    text = page.read_text(encoding="utf-8")
    for name, body in parts.items():
        if not isinstance(body, str):
            body = "\n".join(markdown_table(*table) for table in body)
        pattern = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
        text, found = re.subn(pattern, lambda match, body=body: f"{match[1]}\n{body}\n{match[2]}", text, flags=re.S)
        if found != 1:
            raise typer.BadParameter(f"{page} has no lines <!-- {name} --> and <!-- end -->")
    if check:
        return
    write_atomically(page, lambda temporary: Path(temporary).write_text(text, encoding="utf-8"))


def summary(rows: list[dict]) -> dict:
    """Means over the shapes that gave a skeleton, and how many are right; a failure is not."""
    good = [row for row in rows if "failure" not in row]
    names = ("error", "inside", "completeness", "ends", "radius_error", "cpu")
    values = {name: [row[name] for row in good if row[name] is not None] for name in names}
    right = [row for row in good if row["topology"]]
    counts = dict(n=len(rows), right=len(right), leaves=sum(row["leaves"] == 0 for row in right))
    return counts | {name: fmean(found) if found else float("nan") for name, found in values.items()}


def page_with(*parts: str) -> Callable[[Path | None], Path | None]:
    """A check that a page is there and has the lines between which `fill` puts these parts."""

    def checked(path: Path | None) -> Path | None:
        if path is not None:
            if not path.is_file():
                raise typer.BadParameter(f"there is no page {path}")
            fill(path, dict.fromkeys(parts, ""), check=True)
        return path

    return checked


def number(value: float | None, digits: int = 3) -> str:
    """A number as tables show it; a dash for None and NaN."""
    return "-" if value is None or np.isnan(value) else f"{value:.{digits}f}"


def save(path: Path | None, rows: list[dict]) -> None:
    """Write all rows, with where they come from, as JSON."""
    if path is None:
        return
    told = {"command": sys.argv[1:], **surroundings(), "rows": rows}
    path.write_text(json.dumps(told, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def surroundings() -> dict[str, Any]:
    """The commit, the machine and the versions that results are of."""
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True)
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return {
        "commit": commit.stdout.strip() or None,
        "machine": {
            "system": platform.platform(),
            "processor": _processor(),
            "cores": os.cpu_count(),
            "memory_gb": round(memory, 1),
            "load": round(os.getloadavg()[0], 1),
        },
        "versions": {"python": platform.python_version(), **Report().versions},
    }


def machine() -> str:
    """A line that says where and what was measured."""
    told = surroundings()
    it, versions = told["machine"], ", ".join(f"{name} {version}" for name, version in told["versions"].items())
    return (
        f"Measured on {it['processor']}, {it['cores']} cores, {it['memory_gb']} GB, load {it['load']}, {it['system']}; "
        f"{versions}; commit {told['commit']}; one thread."
    )


def _processor() -> str:
    try:
        return re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())[1]  # type: ignore[index]
    except (OSError, TypeError):
        return platform.processor()
