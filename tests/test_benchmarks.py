"""The accuracy benchmark: its clouds, its arithmetic, and its commands on tiny shapes."""

import importlib
import json
import math
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from typer.testing import CliRunner

from glsk_o3d import pipelines
from glsk_o3d.analysis import compare
from glsk_o3d.batch import run_batch
from glsk_o3d.cli.overrides import override
from glsk_o3d.samples import torus
from glsk_o3d.skeleton import Skeleton


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("accuracy") as module:
        yield module


@pytest.fixture(scope="module")
def parts(tool):
    """The modules that it is made of, by their names."""
    made_of = {"_accuracy", "_common"}
    found = ((name.split("."), module) for name, module in sys.modules.items())
    return SimpleNamespace(**{name[1]: module for name, module in found if name[0] in made_of and name[1:]})


@pytest.fixture
def call(tool):
    """Run a command; gives what it printed."""

    def run(*arguments, code=0):
        result = CliRunner().invoke(tool.app, [*map(str, arguments)])
        assert result.exit_code == code, result.output
        return result.output

    return run


def row(shape="torus", variant="clean_512", pipeline="default", **values):
    found = dict(error=0.1, inside=1.0, completeness=1.0, ends=None, radius_error=0.05, cpu=0.2)
    found |= dict(components=0, loops=0, leaves=0, junctions=0, topology=True)
    return dict(shape=shape, variant=variant, pipeline=pipeline) | found | values


class TestBuiltinClouds:
    @pytest.mark.parametrize(
        "variant", ["clean_300", "density_300", "holes_300", "outliers_300", "noise2_300", "scan2_300"]
    )
    def test_have_their_size_and_are_repeatable(self, parts, variant):
        for shape in parts.clouds.BUILTIN:
            points, axis = parts.clouds.builtin(shape, variant)
            assert points.shape == (300, 3)
            assert len(axis.edges) > 0
            np.testing.assert_array_equal(points, parts.clouds.builtin(shape, variant)[0])

    def test_density_falls_tenfold(self, parts):
        x = parts.clouds.builtin("tube", "density_20000")[0][:, 0]
        dense, thin = (np.count_nonzero(abs(x - at) < 0.05) for at in (0.45, -0.45))
        assert dense / thin == pytest.approx(10**0.75, rel=0.1)

    def test_holes_are_empty_and_sever_nothing(self, parts):
        whole, holed = (parts.clouds.builtin("torus", f"{kind}_4096")[0] for kind in ("clean", "holes"))
        away = cKDTree(holed).query(whole)[0]
        assert 0.08 < away.max() < 0.12
        angle = np.arctan2(holed[:, 1], holed[:, 0])
        assert np.histogram(angle, 100)[0].min() > 0

    def test_two_cameras_see_all_but_what_is_below(self, parts):
        whole, seen = (parts.clouds.builtin("tube", f"{kind}_4096")[0] for kind in ("clean", "scan2"))
        below = [np.count_nonzero(-points[:, 2] > abs(points[:, 1])) for points in (whole, seen)]
        assert below[0] > 800
        assert below[1] < 0.2 * below[0]
        assert cKDTree(seen).query(whole[whole[:, 2] > 0])[0].max() < 0.05

    def test_outliers_are_one_percent(self, parts):
        points = parts.clouds.builtin("torus", "outliers_4096")[0]
        on_ring = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.4, points[:, 2])
        assert np.count_nonzero(abs(on_ring - 0.1) > 1e-9) == 40


class TestArithmetic:
    def test_summary_takes_means_and_counts_failures_as_wrong(self, parts):
        rows = [row(error=0.1, ends=0.5), row(error=0.3, topology=False, loops=1), row(leaves=1, error=0.2)]
        mean = parts.results.summary([*rows, dict(shape="mug", failure="ValueError: no")])
        assert (mean["n"], mean["right"], mean["leaves"]) == (4, 2, 1)
        assert mean["error"] == pytest.approx(0.2)
        assert mean["ends"] == 0.5

    def test_summary_of_failures_only(self, parts):
        mean = parts.results.summary([dict(shape="mug", failure="ValueError: no")])
        assert math.isnan(mean["error"])
        assert mean["right"] == 0

    def test_wrong_says_what(self, parts):
        assert parts.known_axes.wrong(row()) == ""
        assert parts.known_axes.wrong(row(loops=2, components=-1, topology=False)) == "torus +2 loops -1 components"
        assert parts.known_axes.wrong(dict(shape="mug", failure="ValueError: no")) == "mug (ValueError: no)"

    def test_ablation_is_sorted_by_what_is_lost(self, parts):
        rows = [row(), row(variant="noise1_512", error=0.3)]
        for name, error, right in (("spurs cut", 0.1, True), ("denoising", 0.5, True), ("weak loops cut", 0.1, False)):
            rows += [row(pipeline=name, error=error), row(pipeline=name, variant="noise1_512", topology=right)]
        rows += [row(pipeline="cao2010"), row(pipeline="cao2010", variant="noise1_512")]
        ((_, header, lines),) = parts.ideas.ablation_tables(rows)
        assert header == ["", "clean_512 (1)", "noise1_512 (1)", "all (2)", "setting"]
        assert lines[0] == ["default", "0.100 / 1", "0.300 / 1", "0.200 / 2", ""]
        names = [line[0] for line in lines[1:]]
        assert names == ["without denoising", "without weak loops cut", "without spurs cut", "cao2010"]
        assert lines[1] == ["without denoising", "0.500 / 1", "0.100 / 1", "0.300 / 2", "`RingBuilder.denoise=0`"]

    def test_effects_go_behind_the_settings_of_a_page(self, parts, tmp_path):
        rows = [row(), row(variant="noise1_512", error=0.3)]
        rows += [row(pipeline="denoising"), row(pipeline="denoising", variant="noise1_512", error=0.5, topology=False)]
        page = tmp_path / "page.md"
        page.write_text("| a | 1 before<br>`RingBuilder.denoise=0`: ? |\n| b | `Refiner.spur=0`: old |\n")
        parts.ideas.write_effects(page, rows)
        told = "0.200 / 2 → 0.300 / 1; noise1_512: 0.300 / 1 → 0.500 / 0"
        expected = f"| a | 1 before<br>`RingBuilder.denoise=0`: {told} |\n| b | `Refiner.spur=0`: old |\n"
        assert page.read_text() == expected
        parts.ideas.write_effects(page, rows)
        assert page.read_text() == expected

    def test_feet_on_a_square(self, parts):
        nodes = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
        edges = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
        distance, edge, part = parts.axis.feet(np.array([[0.5, 0.1, 0], [3, 2.0, 0], [-1, 0.5, 0]]), nodes, edges)
        np.testing.assert_allclose(distance, [0.1, 1, 1])
        np.testing.assert_array_equal(edge[[0, 2]], [0, 3])
        np.testing.assert_allclose(part[[0, 2]], [0.25, 0.75])

    def test_local_radius_is_interpolated(self, parts):
        axis = SimpleNamespace(nodes=np.array([[0.0, 0, 0], [1, 0, 0]]), edges=np.array([[0, 1]]), radii=np.r_[1.0, 2])
        np.testing.assert_allclose(parts.axis.local_radius(axis, np.array([[0.25, 3, 0], [5, 0, 0]])), [1.25, 2])


class TestPipelines:
    def test_all_ideas_off_are_the_publications(self, parts):
        off = {name: setting.split() for name, setting in parts.ideas.IDEAS.items()}
        published = ("point reduction", "stop by score")
        wen = chain.from_iterable(setting for name, setting in off.items() if name not in published)
        assert override(pipelines.default(), wen) == pipelines.wen2024()
        absent = ("LPRReducer.", "ExplainedScore.", "Contractor.reduce_above")
        left = (setting for setting in chain.from_iterable(off.values()) if not setting.startswith(absent))
        assert override(pipelines.default(), [*left, "Contractor.max_iterations=20"]) == pipelines.cao2010()

    @pytest.mark.parametrize("n", [0, 1, 3, 6])
    def test_as_many_solves_as_asked_for(self, parts, n):
        skeleton = parts.command_line.with_solves(pipelines.default(), n)(torus(512).points)
        assert len(skeleton.report.iterations) == n


class TestCommands:
    def test_truth(self, call, tmp_path):
        out = tmp_path / "out.json"
        printed = call("truth", "--builtin", "--shapes", "tube,torus", "--variant", "clean_512", "-o", out, "--jobs", 1)
        for name in pipelines.PIPELINES:
            assert name in printed
        told = json.loads(out.read_text())
        assert {"commit", "machine", "versions", "command"} < set(told)
        assert len(told["rows"]) == 6
        rows = [found for found in told["rows"] if found["pipeline"] == "default"]
        assert [found["shape"] for found in rows] == ["tube", "torus"]
        assert all(found["topology"] and 0 < found["error"] < 0.2 and found["cpu"] > 0 for found in rows)

    def test_a_shape_that_fails_is_a_row(self, call, tmp_path):
        ring = torus(512)
        axis = dict(nodes=ring.nodes, edges=ring.edges, radii=ring.radii)
        np.savez(tmp_path / "good.npz", **axis, clean_512=ring.points)
        np.savez(tmp_path / "few.npz", **axis, clean_512=ring.points[:3])
        (tmp_path / "broken.npz").write_text("this is no archive")
        printed = call("truth", tmp_path, "--variant", "clean_512", "--pipeline", "default", "--markdown", "--jobs", 0)
        assert "1/3" in printed
        assert "few (InvalidCloudError: 3 finite points" in printed
        assert "broken (" in printed

    def test_ablation(self, call):
        few = ("--builtin", "--shapes", "torus", "--variant", "clean_512", "--idea", "spurs cut,mended rings")
        lines = call("ablation", *few, "--markdown", "--jobs", 0).splitlines()
        table = [line for line in lines if line.startswith("|")]
        assert table[0] == "|  | clean_512 (1) | all (1) | setting |"
        assert len(table) == 7
        assert "without spurs cut" in "".join(table[3:5])

    def test_ablation_writes_into_a_page(self, call, tmp_path):
        page = tmp_path / "page.md"
        page.write_text("| `Refiner.spur=0`:  |")
        few = ("--builtin", "--shapes", "torus", "--variant", "clean_512", "--idea", "spurs cut", "--jobs", 0)
        call("ablation", *few, "--page", page)
        assert re.fullmatch(
            r"\| `Refiner.spur=0`: 0.\d+ / 1 → 0.\d+ / 1; clean_512: 0.\d+ / 1 → .* \|", page.read_text()
        )

    def test_settings(self, call, tmp_path):
        few = ("--builtin", "--shapes", "torus", "--pipeline", "default", "--jobs", 0, "-o", tmp_path / "out.json")
        settings = ("--set", "Contractor.max_iterations=1", "--set", "Refiner.spur=0")
        printed = call("truth", *few, "--variant", "clean_512,clean_300", *settings, "--markdown")
        rows = json.loads((tmp_path / "out.json").read_text())["rows"]
        assert [row["solves"] for row in rows] == [1, 1]
        assert "**all**" in printed
        assert "/2 |" in printed.partition("**all**")[2]

    def test_a_page_and_its_pictures(self, call, tmp_path, monkeypatch):
        few = ("--builtin", "--shapes", "torus", "--variant", "clean_512,noise1_512", "--jobs", 0)
        saved = [tmp_path / f"{command}.json" for command in ("truth", "ablation", "stop")]
        for path in saved:
            words = (path.stem, *few, *(("--idea", "spurs cut,thinning") if path.stem == "ablation" else ()))
            monkeypatch.setattr(sys, "argv", ["accuracy.py", *map(str, words)])  # so that the file says what it is
            call(*words, "-o", path)
        page = tmp_path / "page.md"
        page.write_text("".join(f"<!-- {path.stem} -->\nold\n<!-- end -->\n" for path in saved))
        call("page", page, *saved)
        text = page.read_text()
        assert text.count("| clean_512 | `default` |") == text.count("|  | `wen2024` |") - 1 == 1
        assert text.count("| without ") == 2
        assert text.count("| rule |") == 2
        assert "old" not in text
        pictures = {path.stem: path.read_bytes() for path in (tmp_path / "images").iterdir()}
        assert set(pictures) == {"accuracy_clouds", "accuracy_ideas", "accuracy_solves"}
        call("page", page, *saved[::-1])
        assert page.read_text() == text
        assert {path.stem: path.read_bytes() for path in (tmp_path / "images").iterdir()} == pictures
        saved[0].write_text(json.dumps(dict(command=["mass"], rows=[])))
        assert "holds results of mass" in call("page", page, saved[0], code=2)

    def test_rotations(self, call, tmp_path):
        out = tmp_path / "out.json"
        few = ("--builtin", "--shapes", "1", "--variant", "clean_512", "--count", 1)
        call("rotations", *few, "-o", out, "--jobs", 0)
        (found,) = json.loads(out.read_text())["rows"]
        assert (found["runs"], found["topology_changes"], len(found["moves"])) == (1, 0, 1)
        assert found["moves"][0] < 0.5

    def test_stop_and_mass(self, call):
        few = ("--builtin", "--shapes", "torus", "--variant", "clean_512", "--markdown", "--jobs", 0)
        printed = call("stop", *few)
        assert [line.split()[1] for line in printed.splitlines() if line.startswith("|")][2:] == [*"0123456", "rule"]
        assert "| mean | " in call("mass", *few)

    def test_loops(self, call, tmp_path):
        np.savetxt(tmp_path / "ring.xyz", torus(512).points)
        listed = [dict(name="ring", path="ring.xyz", n_points=512, loops=1, meaningful_skeleton=True)]
        listed += [dict(listed[0], name="gone", path="gone.xyz"), dict(listed[0], name="big", n_points=10**6)]
        (tmp_path / "manifest.json").write_text(json.dumps(listed))
        printed = call("loops", tmp_path, "--markdown", "--jobs", 0)
        assert "default: 1 of 2 right" in printed
        assert "| ring | 512 | " in printed
        assert "| gone | - |" in printed

    @pytest.mark.parametrize(
        "wrong",
        [
            ("truth", "--builtin", "--shapes", "teapot"),
            ("truth", "--builtin", "--variant", "dirty_512"),
            ("truth", "--builtin", "--pipeline", "wen2023"),
            ("truth", "no_such_folder"),
            ("truth", "--builtin", "--set", "Refiner.magic=1"),
            ("rotations", "--builtin", "--set", "Refiner.magic=1"),
            ("ablation", "--builtin", "--idea", "magic"),
            ("ablation", "--builtin", "--page", "no_such_page.md"),
            ("mass", "--builtin", "-o", "no_such_folder/out.json"),
        ],
    )
    def test_wrong_usage_is_found_at_once(self, call, wrong):
        assert "Invalid value" in call(*wrong, code=2)


class TestCrosscheck:
    @pytest.fixture
    def tool(self, benchmark):
        with benchmark("crosscheck") as module:
            yield module

    def test_verdicts(self, call, tmp_path):
        words = ("--builtin", "--shapes", "tube,torus", "--variant", "clean_1500,noise5_300", "--jobs", 0)
        table = " ".join(call("verdicts", *words, "-o", tmp_path / "r.json").split())
        rows = json.loads((tmp_path / "r.json").read_text())["rows"]
        assert [row["verdict"] for row in rows[:2]] == ["agrees"] * 2
        assert all(row["good"] for row in rows[:2])
        assert "clean_1500 2 / 2 0 / 0 0 / 0" in table
        assert "all" in table

    def test_curvature(self, call):
        table = " ".join(call("curvature", "--sizes", "300", "--jobs", 0).split())
        assert "even sphere 300 ours 0." in table
        assert "cylinder 300 mesh " in table

    def test_scans(self, call, tmp_path):
        np.savetxt(tmp_path / "ring.xyz", torus(1000).points)
        table = call("scans", tmp_path / "ring.xyz", "--pictures", tmp_path, "--jobs", 0)
        assert "agrees (ball pivoting)" in table
        assert (tmp_path / "ring.png").is_file()


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")  # the work is done in this process
def test_scans_for_batches(benchmark, tmp_path):
    (tmp_path / "in").mkdir()
    with benchmark("batch") as batch, ThreadPoolExecutor(1) as pool:
        batch.make_scans(tmp_path / "in", 12, 256, 400)
        result = run_batch(tmp_path / "in", tmp_path / "out", executor=pool)
    failed = {name[5:] for name, row in result.rows.items() if row["status"] == "failed"}
    assert failed == {name.partition(".")[0] for name in batch.CORRUPT}
    sizes = [row["points"] for row in result.rows.values() if row["status"] == "done"]
    assert len(sizes) == 12
    assert 256 <= min(sizes) < max(sizes) <= 400


BAD = """
import os, signal, time
import numpy as np

def crash(points):
    os.kill(os.getpid(), signal.SIGSEGV)

def hang(points):
    while True:
        time.sleep(600)

def nothing(points):
    return np.empty((0, 3)), np.empty((0, 2), int)
"""


class TestOptions:
    @pytest.fixture
    def tool(self, benchmark):
        with benchmark("options") as module:
            yield module

    def test_tables(self, tool):
        def row(cloud, settings, seed):
            values = dict(error=0.1 * seed, radius_error=0.05, ends=0.5, leaves=seed - 1, vertices=60 + seed)
            return dict(cloud=cloud, settings=settings) | values

        found = tool.tables([row(*which, seed) for which in tool.wanted() for seed in range(3)])
        ((_, _, spurs),), ((_, header, radii),), ((_, _, spacing),) = (found[part] for part in tool.PARTS)
        assert [line[0] for line in spurs] == list(tool.SPURS)
        assert {cell for line in spurs for cell in line[1:]} == {"-1 0 +1"}
        assert dict(zip(header, radii[0], strict=True))["ends, `k=24`"] == "0.50"
        assert spacing[0] == ["`torus`", *["61, 0.100"] * 3]

    def test_one_draw(self, tool, tmp_path, monkeypatch):
        monkeypatch.setattr(tool, "wanted", lambda: [("`torus`", "Refiner.spacing=1")])
        monkeypatch.setattr(
            tool, "tables", lambda rows: {part: [(part, ["cloud"], [[rows[0]["cloud"]]])] for part in tool.PARTS}
        )
        page, out = tmp_path / "page.md", tmp_path / "out.json"
        page.write_text("".join(f"<!-- {part} -->\n<!-- end -->\n" for part in tool.PARTS))
        tool.options(page, draws=1, jobs=0, output=out)
        (row,) = json.loads(out.read_text())["rows"]
        assert row["topology"]
        assert row["leaves"] == 0
        assert 20 < row["vertices"] < 50
        assert page.read_text().count("| `torus` |") == 3


class TestPeers:
    @pytest.fixture
    def tool(self, benchmark):
        with benchmark("peers") as module:
            yield module

    def test_one_that_crashes_or_hangs_is_a_failure_and_ends_nothing(self, tool, call, tmp_path, monkeypatch):
        (tmp_path / "bad_tools.py").write_text(BAD)
        monkeypatch.syspath_prepend(tmp_path)
        module = importlib.import_module("bad_tools")
        names = ("crash", "hang", "nothing")
        bad = {name: tool.Peer(name, (), "points", getattr(module, name)) for name in names}
        monkeypatch.setattr(tool, "PEERS", bad | {"default": tool.PEERS["default"]})
        page, out = tmp_path / "page.md", tmp_path / "out.json"
        page.write_text("<!-- builtin -->\n<!-- end -->\n<!-- folder -->\nkept\n<!-- end -->\n")
        few = ("--builtin", "--shapes", "torus", "--variant", "clean_512", "--jobs", 2, "-o", out)
        call(*few, "--tool", "crash,nothing,default", "--limit", 0)
        call(*few, "--tool", "hang", "--limit", 1, "--from", out, "--page", page)
        rows = {row["tool"]: row for row in json.loads(out.read_text())["rows"]}
        assert rows["crash"]["failure"] == "its process died: SIGSEGV"
        assert rows["hang"]["failure"] == "not done after 1 s"
        assert rows["nothing"]["failure"].startswith("InvalidParameterError: the skeleton is empty")
        assert rows["default"]["topology"]
        assert 0 < rows["default"]["error"] < 0.2
        lines = page.read_text().splitlines()
        assert "kept" in lines
        assert any(line.startswith("| crash | points | - / 0 | - |") for line in lines)
        assert any(line.endswith("| torus (not done after 1 s) |") for line in lines)
        del sys.modules["bad_tools"]
        again = call(*few, "--from", out)  # nothing is measured
        assert "torus (not done after 1 s)" in again

    def test_picture(self, call, tmp_path):
        few = ("--builtin", "--shapes", "tube", "--variant", "clean_256", "--tool", "default", "--jobs", 1)
        call(*few, "--limit", 0, "--picture", tmp_path / "peers.png")
        assert (tmp_path / "peers.png").read_bytes().startswith(b"\x89PNG")

    @pytest.mark.filterwarnings("ignore")  # theirs
    def test_tools_that_are_installed(self, tool):
        there = {name: peer for name, peer in tool.PEERS.items() if None not in peer.versions().values()}
        others = [name for name, peer in there.items() if peer.packages]
        if not others:
            pytest.skip("none of the other tools is installed: make peers")
        points, axis = importlib.import_module("_common.clouds").builtin("tube", "clean_4096")
        for name in others:
            vertices, edges = there[name](points)
            found = compare(Skeleton(vertices, edges, [math.nan] * len(vertices), (), (), ()), axis)
            assert found.topology, name
            assert found.error < 0.5, name

    @pytest.mark.parametrize(
        "wrong", [("--tool", "magic"), ("--page", "no_such_page.md"), ("--picture", "no_such_folder/p.png")]
    )
    def test_wrong_usage_is_found_at_once(self, call, wrong):
        assert "Invalid value" in call("--builtin", *wrong, code=2)

    def test_one_that_is_absent_is_named(self, tool, call, monkeypatch):
        absent = tool.Peer("gone", ("no-such-package",), "points", None)
        monkeypatch.setattr(tool, "PEERS", {"gone": absent, "default": tool.PEERS["default"]})
        assert "not installed: gone" in call("--builtin", "--tool", "gone", code=2)
        few = ("--builtin", "--shapes", "tube", "--variant", "clean_256", "--jobs", 1)
        assert "not installed: gone" in call(*few)
