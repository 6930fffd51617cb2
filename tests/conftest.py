"""Fixtures for all tests."""

import importlib
import math
import os
import shutil
import sys
import textwrap
from concurrent.futures import Future
from dataclasses import fields, replace
from pathlib import Path
from time import sleep
from types import ModuleType, SimpleNamespace

import networkx as nx
import numpy as np
import pytest
import tomlkit
from glsk_bench import make as make_benchmark
from glsk_bench import versions
from hypothesis import HealthCheck, settings
from typer.testing import CliRunner

from glsk_o3d import save_skeleton
from glsk_o3d.data.report import IterationRecord, Report
from glsk_o3d.data.skeleton import Skeleton
from glsk_o3d.data.verdict import Reason
from glsk_o3d.filters.ring_builder import RingBuilder
from glsk_o3d.recipes.plugins import forget_plugins

ROOT = Path(__file__).resolve().parents[1]

# No test depends on the clock: a busy machine makes examples slow, not wrong. And no example depends on chance: what
# failed yesterday fails today.
settings.register_profile("suite", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("suite")

SLOW = """
analysis/test_assessment analysis/test_grasp apps benchmark cli interop io/formats io/test_skeletons io/test_streaming
recipes ros2 samples test_architecture test_benchmarks test_calibrate test_constants test_digest test_examples
test_external test_filter_scripts test_fuzz test_leaderboard test_speed test_trees viewing
""".split()  # noqa: SIM905
"""Folders and modules, by how their paths in `tests` begin, that are slow as a whole; single tests have the marker."""


def pytest_collection_modifyitems(items):
    beginnings = tuple(str(ROOT / "tests" / name) for name in SLOW)
    for item in items:
        if str(item.path).startswith(beginnings) or isinstance(item, pytest.DoctestItem):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return ROOT


@pytest.fixture(scope="session")
def shared_dir() -> Path:
    """Clouds and recorded results that are not in the repository: $GLSK_SHARED, or the folder ../shared."""
    place = Path(os.environ.get("GLSK_SHARED", ROOT.parent / "shared"))
    if not place.is_dir():
        pytest.skip(f"needs the data folder {place}, which is not in the repository (set GLSK_SHARED)")
    return place


@pytest.fixture
def no_run(monkeypatch):
    """Fail if anything is computed."""

    def run(self, data, watch):
        pytest.fail("computed before everything was checked")

    monkeypatch.setattr(RingBuilder, "run", run)


@pytest.fixture
def call(request):
    """Run a command of the study that a test's module names STUDY; gives what it printed."""

    def run(*arguments, code=0):
        result = CliRunner().invoke(request.module.STUDY.app, [*map(str, arguments)])
        assert result.exit_code == code, result.output
        return result.output

    return run


@pytest.fixture(scope="session")
def patience() -> float:
    """Seconds, where somebody else's function must be told how long to wait: more than any busy machine needs."""
    return 900.0


@pytest.fixture(scope="module")
def launch(patience):
    """Start a headless Chromium with other flags than the usual ones."""
    names = (os.environ.get("GLSK_CHROMIUM", ""), "chromium", "chromium-browser", "google-chrome", "chrome")
    browser = next(filter(None, map(shutil.which, names)), None)
    if browser is None:
        pytest.skip("needs Chromium: apt-get install chromium, or set GLSK_CHROMIUM to where it is")
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright, of the extra 'dev'")
    with playwright.sync_playwright() as driver:
        running = []

        def start(*flags):
            flags = ("--no-sandbox", "--disable-background-networking", *flags)  # root may not have a sandbox
            running.append(driver.chromium.launch(executable_path=browser, args=flags, timeout=1e3 * patience))
            return running[-1]

        yield start
        for each in running:
            each.close()


@pytest.fixture(scope="session")
def until():
    """Wait until something is true, however long it takes, unless one of the processes that bring it about has ended.

    What never comes true is ended with its test by ``faulthandler_timeout`` in ``pyproject.toml``.
    """

    def wait(condition, *processes):
        while True:
            ended = [process.args for process in processes if process.poll() is not None]
            if value := condition():
                return value
            assert not ended, "waited in vain"
            sleep(0.02)

    return wait


@pytest.fixture(scope="session")
def assert_sound():
    """A check that a skeleton keeps all promises that its class makes."""

    def check(skeleton, n_points, n_dropped=0, triangles=False):
        vertices, edges, owner = skeleton.vertices, skeleton.edges, skeleton.vertex_of_point
        m = len(vertices)
        assert m > 0
        assert vertices.shape == (m, 3)
        assert skeleton.radii.shape == (m,)
        assert vertices.dtype == skeleton.radii.dtype == np.float64
        assert np.isfinite(vertices).all()
        assert ((skeleton.radii >= 0) & (skeleton.radii < np.inf)).all()

        assert edges.shape[1:] == (2,)
        assert edges.dtype == owner.dtype == np.int64
        assert (edges[:, 0] < edges[:, 1]).all()
        assert edges.size == 0 or (edges.min() >= 0 and edges.max() < m)
        np.testing.assert_array_equal(edges, np.unique(edges, axis=0))
        if not triangles:
            assert not any(nx.triangles(nx.Graph(edges.tolist())).values())

        assert owner.shape == (n_points,)
        assert -1 <= owner.min() <= owner.max() < m
        assert (owner == -1).sum() == n_dropped
        assert skeleton.points.shape == skeleton.normals.shape == (n_points, 3)
        lengths = np.linalg.norm(skeleton.normals[skeleton.supporting_points], axis=1)
        np.testing.assert_allclose(lengths, 1, atol=1e-12)
        report, silent = skeleton.report, np.isnan(skeleton.normals).any(axis=1)
        said = n_dropped + report.n_outliers
        if report.n_traced:  # there is no surface
            assert max(said, report.n_traced) <= silent.sum()
        else:
            assert silent.sum() == said
        assert silent[owner < 0].all()

        assert report.n_input == n_points
        assert report.n_dropped == n_dropped
        assert 0 < report.n_distinct <= n_points - n_dropped - report.n_outliers
        assert report.stop_reason

    return check


def build(vertices, edges, n_points=7, seed=0):
    """A skeleton with awkward numbers in every field: no short decimals, dropped points, NaN and infinity."""
    rng = np.random.default_rng(seed)
    m = len(vertices)
    points, normals = rng.normal(size=(2, n_points, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    owners = rng.integers(0, m, n_points)
    points[0], points[1], normals[:2], owners[:2] = np.nan, [np.inf, -np.inf, -0.0], np.nan, -1
    floats = iter([0.1 + 0.2, math.nan, 1 / 3, math.inf, -0.0, 1e-300, np.float64(0.9), -math.inf] * 9)
    wholes = iter([1, np.int64(4), 2**53 + 1] * 9)
    records = tuple(
        IterationRecord(**{f.name: next(wholes if f.type in (int, "int") else floats) for f in fields(IterationRecord)})
        for _ in range(2)
    )
    report = Report(
        n_input=n_points, seconds={"RingBuilder": 1 / 7}, iterations=records, reasons=(Reason("other", "häßlich"),)
    )
    confidence = np.where(np.arange(m) == 1, np.nan, rng.random(m) / 3)
    return Skeleton(vertices, edges, rng.random(m) / 3, owners, points, normals, report, confidence)


@pytest.fixture
def make():
    return build


@pytest.fixture
def tree():
    """A trunk with a fork: 6 vertices, 5 edges, 3 leaves, 1 junction."""
    vertices = np.array([[0, 0, 0], [0, 0, 1], [0.1, 0, 2], [1, 0, 3], [-1, 1 / 3, 3], [-1.5, 0.7, 4]]) * math.pi
    return build(vertices, [[0, 1], [1, 2], [2, 3], [2, 4], [4, 5]])


@pytest.fixture
def loop():
    """A ring of five vertices with a tail and with one long chord: two loops."""
    angle = np.arange(5) * 0.4 * np.pi
    vertices = np.array([*np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), [2, 0, 0]])
    return build(vertices, [[0, 1], [0, 2], [0, 4], [0, 5], [1, 2], [2, 3], [3, 4]])


@pytest.fixture
def forest():
    """Two paths and a vertex by itself: three components."""
    vertices = np.random.default_rng(5).normal(size=(6, 3)) + [1e6, 0, 0]
    return build(vertices, [[0, 3], [1, 2], [2, 5]])


@pytest.fixture
def dot():
    """One vertex, no edge."""
    return build(np.array([[0.1, 0.2, 0.3]]), np.empty((0, 2)))


@pytest.fixture(params=["tree", "loop", "forest", "dot"])
def skeleton(request):
    return request.getfixturevalue(request.param)


@pytest.fixture
def bare(tree):
    """A skeleton without a cloud."""
    return replace(tree, points=(), normals=(), vertex_of_point=())


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Install a module with entry points into a folder on the path, as pip would, and take it away afterwards."""
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    before = set(sys.modules)

    def add(distribution: str, version: str, code: str, entry_points: str) -> Path:
        module = distribution.replace("-", "_")
        (folder / f"{module}.py").write_text(code)
        info = folder / f"{module}-{version}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n")
        (info / "entry_points.txt").write_text(entry_points)
        importlib.invalidate_caches()
        forget_plugins()
        return folder

    yield add
    for name in set(sys.modules) - before:
        if str(folder) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]
    forget_plugins()


@pytest.fixture
def example(install, root):
    """The example plugin, installed; gives the folder that it is in."""
    source = root / "tests" / "example_plugin"
    text = (source / "pyproject.toml").read_text()
    groups = tomlkit.parse(text)["project"]["entry-points"]
    entries = "".join(
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in entries.items())
        for group, entries in groups.items()
    )
    return install("glsk-example", "0.3", (source / "glsk_example.py").read_text(), entries)


def straight(family, seed):
    """A rod in the place of a shape that is rods: longer with the seed, and bent in one family."""
    bend = 0.1 if family == "trees" else 0.0
    nodes = np.array([[-0.4, 0, 0], [0, bend, 0], [0.003 * seed, 0, 0]])
    axis = dict(nodes=nodes, edges=np.array([[0, 1], [1, 2]]), radii=np.full(3, 0.05))
    rng = np.random.default_rng(seed)
    part, turn = rng.random(20_000), rng.uniform(0, 2 * np.pi, 20_000)
    along, beside = (np.interp(part, [0, 0.5, 1], nodes[:, column]) for column in (0, 1))
    points = np.column_stack([along, beside + 0.05 * np.cos(turn), 0.05 * np.sin(turn)])
    facts = dict(length=np.float64(0.8), loops=np.int64(0), many=np.arange(2))
    return SimpleNamespace(name=f"{family}_{seed}", family=family, seed=seed, points=points, facts=facts, **axis)


@pytest.fixture
def rods(monkeypatch):
    """Rods instead of the shapes of the benchmark, which take seconds; gives the names of those that are rods."""
    names = []

    def shape(family, seed, *, steady=False):
        names.append(f"{family}_{seed}")
        return straight(family, seed)

    def cloud(shape, variant, n=4096, seed=0):
        rng = np.random.default_rng([len(variant), shape.seed, seed])
        return shape.points[rng.permutation(len(shape.points))[:n]]

    shapes, clouds = ModuleType("shapes"), ModuleType("clouds")
    shapes.shape = shape
    clouds.cloud = cloud
    clouds.coverage = lambda shape, points: 0.5 if shape.name == "trees_101" else 0.99
    monkeypatch.setitem(sys.modules, "glsk_bench.shapes", shapes)
    monkeypatch.setitem(sys.modules, "glsk_bench.clouds", clouds)
    monkeypatch.setattr(versions, "_file", lambda name: ROOT / "none")  # what the package knows is not of rods
    return names


@pytest.fixture
def small(rods, tmp_path):
    """A benchmark of four shapes and eight clouds, of which seven are scored."""
    choice = dict(families=["tubes", "trees"], seeds=[100, 101], variants=["clean", "scan2"])
    return make_benchmark(tmp_path / "bench", **choice, jobs=1)


def axis_of(made, cloud):
    truth = made.truth(cloud.shape)
    return Skeleton(truth.nodes, truth.edges, truth.radii, (), (), ())


@pytest.fixture
def perfect(small, tmp_path):
    """A folder with the true axes as answers."""
    place = tmp_path / "perfect"
    place.mkdir()
    for cloud in small.scored:
        save_skeleton(axis_of(small, cloud), place / f"{cloud.name}.obj")
    return place


@pytest.fixture
def program(tmp_path):
    """The words of a command for a program of this source, which has the names `cloud` and `skeleton`."""

    def write(source, *options):
        path = tmp_path / "program.py"
        head = "import os, sys, time\ncloud, skeleton = sys.argv[1:3]\nname = os.path.basename(cloud)[:-4]\n"
        rod = 'def write(path, more=""):\n    open(path, "w").write("v 0 0 0\\nv 1 0 0\\nl 1 2\\n" + more)\n'
        path.write_text(head + rod + textwrap.dedent(source))
        return [sys.executable, "-S", "-E", str(path), "{cloud}", "{skeleton}", *options]

    return write


@pytest.fixture(scope="session")
def flat_bar():
    """A bar along z of length 4 with a rectangular section, half axes along x and y, and its axis of radius 0.3."""

    def make(width, thickness, seen=(0, 0, 0), n=6000):
        rng = np.random.default_rng(0)
        side, sign, place = rng.integers(0, 2, n), rng.choice([-1, 1], n), rng.uniform(-1, 1, (n, 2))
        normals = np.zeros((n, 3))
        normals[np.arange(n), side] = sign
        points = np.column_stack([place[:, 0], place[:, 0], 2 * place[:, 1]])
        points[np.arange(n), side] = sign
        kept = normals @ seen >= 0
        points, normals = points[kept] * [width, thickness, 1], normals[kept] * rng.choice([-1, 1], (kept.sum(), 1))
        vertices = np.outer(np.linspace(-2, 2, 41), [0, 0, 1])
        edges = np.column_stack([np.arange(40), np.arange(1, 41)])
        owner = np.rint((points[:, 2] + 2) * 10).astype(int)
        return Skeleton(vertices, edges, np.full(41, 0.3), owner, points, normals)

    return make


@pytest.fixture
def at_once(monkeypatch):
    """Do the work of batches in this process; gives how many workers were asked for."""
    counts = []

    class Here:
        def __init__(self, count):
            counts.append(count)
            self.count = 2

        def submit(self, function, task):
            future = Future()
            future.set_result(function(task))
            return future

        def close(self, *, at_once):
            pass

    monkeypatch.setattr("glsk_o3d.apps.batch.run.Workers", Here)
    return counts
