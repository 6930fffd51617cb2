"""The accuracy benchmark: its clouds, its arithmetic, and its commands on tiny shapes."""

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

from glsk_o3d import pipelines, read_cloud
from glsk_o3d.batch import run_batch
from glsk_o3d.cli.overrides import override
from glsk_o3d.samples import torus


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


def row(shape="torus", variant="clean_512", pipeline="default", **values):
    found = dict(error=0.1, inside=1.0, completeness=1.0, length=1.0, ends=None, radius_error=0.05, cpu=0.2)
    found |= dict(tips_f1=1.0, junctions_f1=1.0, components=0, loops=0, leaves=0, junctions=0)
    found |= dict(topology=True, perfect=True, family="built-in", seed=None, draw=0)
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

    def test_draws_differ_and_the_first_is_that_without_a_number(self, parts):
        for kind in ("clean", "holes"):
            first, again, second = (parts.clouds.builtin("torus", f"{kind}_300", *draw)[0] for draw in ((), (0,), (1,)))
            np.testing.assert_array_equal(first, again)
            assert not (first == second).any()

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


@pytest.fixture
def zoo(tmp_path):
    """Two folders of shapes drawn at random; the second has one shape again, and one whose clouds show too little."""
    ring = torus(512)
    axis = dict(nodes=ring.nodes, edges=ring.edges, radii=ring.radii)

    def folder(name, covers):
        (tmp_path / name).mkdir()
        for shape in covers:
            np.savez(tmp_path / name / f"{shape}.npz", **axis, clean_512=ring.points, scan2_512=ring.points[::-1])
        shapes = [dict(name=it, meaningful_skeleton=True, coverage=dict(scan2_512=c)) for it, c in covers.items()]
        (tmp_path / name / "manifest.json").write_text(json.dumps(dict(variants=["clean", "scan2"], shapes=shapes)))
        return tmp_path / name

    return folder("one", dict(rings_0=1.0, rings_1=0.97, big_rings_7=0.969)), folder("two", dict(rings_1=1.0, mug=0.96))


class TestFolders:
    def test_families_seeds_and_draws(self, parts, zoo):
        found = parts.clouds.cases(zoo, False, "clean_512,scan2_512")
        told = [(case.variant, *(case.facts[name] for name in ("family", "seed", "draw"))) for case in found]
        rings = [("rings", 0, 0), ("rings", 1, 0), ("rings", 1, 1)]
        assert told == [
            *(("clean_512", *it) for it in [*rings, ("big_rings", 7, 0), ("two", None, 0)]),
            *(("scan2_512", *it) for it in rings),  # of the others too little is seen
        ]
        assert [case.folder for case in found[1:3]] == list(zoo)

    def test_what_is_left_out_is_said(self, parts, zoo, capsys):
        parts.clouds.cases(zoo, False, "clean_512,scan2_512,depth2_512", "rings_1,mug")
        assert capsys.readouterr().err == "left out: scan2_512 of 1 shapes\nleft out: depth2_512 of 2 shapes\n"

    def test_patterns(self, parts, zoo):
        found = parts.clouds.cases(zoo[0], False, "s*_512,*_512,clean_512")
        assert list(dict.fromkeys(case.variant for case in found)) == ["scan2_512", "clean_512"]

    def test_a_public_benchmark(self, parts, small):
        found = parts.clouds.cases(small.path, False, "*")
        assert [(case.shape, case.variant) for case in found[:2]] == [("trees_100", "clean"), ("trees_101", "clean")]
        assert {(case.shape, case.variant) for case in found} == {(it.shape, it.variant) for it in small.scored}
        points, axis = found[0].load()
        np.testing.assert_array_equal(points, read_cloud(small.scored[0].path).points)
        assert len(axis.radii) == 3
        assert (found[0].size, found[0].facts["family"], found[0].facts["seed"]) == (len(points), "trees", 100)

    def test_draws_are_of_built_in_shapes_alone(self, parts, zoo):
        assert [it.draw for it in parts.clouds.cases(None, True, "clean_512", "tube,torus", 3)] == [0, 1, 2] * 2
        assert [it.draw for it in parts.clouds.cases(zoo[0], False, "clean_512", "rings_0", 3)] == [0]


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

    def test_overview_by_cloud_and_by_family(self, parts):
        rows = [row("rings_0", family="rings", seed=0, cpu=0.4), row("rings_1", family="rings", seed=1, perfect=False)]
        rows += [row("knots_0", family="knots", seed=0, error=0.3, topology=False, perfect=False, tips_f1=0.5)]
        rows += [dict(row("rings_0", "scan2_512", family="rings", seed=0), failure="ValueError: no")]
        for name in ("topology", "perfect", "error"):
            del rows[-1][name]
        rows += [row("mug", family="truth", error=0.9)]
        by_cloud, by_family = parts.known_axes.overview(rows)
        header = ["pipeline", "clouds", "topology", "perfect", "error", "tips F1", "junctions F1", "length", "CPU s"]
        assert (by_cloud[1], by_family[1]) == (["cloud", *header], ["family", *header])
        assert [line[:3] for line in by_cloud[2]] == [
            ["clean_512", "`default`", "3"],
            ["scan2_512", "`default`", "1"],
            ["all", "`default`", "4"],
        ]
        assert by_cloud[2][0][3:] == ["0.67 [0.00, 1.00]", "0.33 [0.00, 1.00]", "0.167", "0.83", "1.00", "1.00", "0.27"]
        assert by_cloud[2][1][3:6] == ["0.00 [0.00, 0.00]", "0.00 [0.00, 0.00]", "-"]
        assert [(line[0], line[2], line[5]) for line in by_family[2]] == [
            ("rings", "3", "0.100"),
            ("knots", "1", "0.300"),
            ("truth", "1", "0.900"),
        ]

    def test_overview_of_shapes_that_are_not_random(self, parts):
        ((_, _, lines),) = parts.known_axes.overview([row(), row("mug"), row(pipeline="cao2010")])
        assert [line[:3] for line in lines] == [["clean_512", "`default`", "2"], ["", "`cao2010`", "1"]]

    def test_differences_are_paired(self, parts, capsys):
        names = [f"rings_{i}" for i in range(20)]
        before = [row(it, error=0.1 + 0.01 * i, topology=i < 10, seed=i) for i, it in enumerate(names)]
        after = [row(it, error=0.09 + 0.01 * i, topology=i not in (3, 19), seed=i) for i, it in enumerate(names)]
        after[0] = dict(row(names[0], seed=0), failure="ValueError: no")
        for name in ("topology", "perfect", "error"):
            del after[0][name]
        pairs = parts.differences.paired([*before, row("gone")], after)
        assert capsys.readouterr().err == "left out: 1 clouds that only one file has\n"
        ((_, header, (line,)),) = parts.differences.difference_tables(pairs)
        told = dict(zip(header[-2:], line[-2:], strict=True))
        assert told == {"now right": ", ".join(names[10:19]), "now wrong": "rings_0, rings_3"}
        assert line[:4] == ["clean_512", "`default`", "20", "0.50 → 0.85"]
        assert line[4].startswith("+0.35 [+0.05, +0.6")
        assert line[5] == "1.00 → 0.95"
        assert line[7:9] == ["0.200 → 0.190", "-0.010 [-0.010, -0.010]"]  # of the pairs that both have one

    def test_ablation_is_sorted_by_what_is_lost(self, parts):
        rows = [row(), row(variant="noise1_512", error=0.3)]
        for name, error, right in (("spurs cut", 0.1, True), ("denoising", 0.5, True), ("air cut", 0.1, False)):
            rows += [row(pipeline=name, error=error), row(pipeline=name, variant="noise1_512", topology=right)]
        rows += [row(pipeline="cao2010"), row(pipeline="cao2010", variant="noise1_512")]
        ((_, header, lines),) = parts.ideas.ablation_tables(rows)
        assert header == ["", "clean_512 (1)", "noise1_512 (1)", "all (2)", "setting"]
        assert lines[0] == ["default", "0.100 / 1", "0.300 / 1", "0.200 / 2", ""]
        names = [line[0] for line in lines[1:]]
        assert names == ["without denoising", "without air cut", "without spurs cut", "cao2010"]
        assert lines[1] == ["without denoising", "0.500 / 1", "0.100 / 1", "0.300 / 2", "`RingBuilder.denoise=0`"]

    def test_what_ideas_are_worth(self, parts):
        """Pairs of the same cloud; a failure has the wrong topology, and no error to compare."""
        names = [f"tubes_{seed}" for seed in range(4)]
        rows = [row(name, error=0.1) for name in names]
        rows += [row(name, "holes_512", error=0.1) for name in names]
        rows += [row(name, pipeline="air cut", error=0.3, perfect=False) for name in names[:3]]
        rows += [dict(shape="tubes_3", variant="clean_512", pipeline="air cut", draw=0, failure="ValueError: no")]
        rows += [row(name, "holes_512", "air cut", error=0.1) for name in names]
        rows += [row(name, variant, "denoising") for name in names for variant in ("clean_512", "holes_512")]
        ((title, header, (first, air, denoising)),) = parts.ideas.worth_tables(parts.ideas.of_worth(rows))
        assert title.startswith("what 8 clouds lose")
        assert first[:4] == ["`default`", "1.00", "1.00", "0.100"]
        cells = dict(zip(header, air, strict=True))
        assert cells["perfect"].startswith("-0.50 [")
        assert cells["topology"].startswith("-0.12 [")  # one of eight
        assert cells["error"].startswith("+0.086 [")  # three of seven
        assert (cells["most in"], cells["topology there"]) == ("clean_512", "1.00 → 0.75")
        assert cells["setting"] == "`Refiner.air=0`"
        assert denoising[1:6] == ["+0.00 [+0.00, +0.00]"] * 2 + ["+0.000 [+0.000, +0.000]", "-", "-"]

    def test_the_paper_has_what_ideas_are_worth(self, tool, root):
        page = (root / "docs" / "paper.md").read_text(encoding="utf-8")
        assert f"<!-- worth -->\n\n{tool.worth_text()}" in page

    def test_worth_keeps_results_and_fills_a_page(self, tool, call, tmp_path, monkeypatch):
        monkeypatch.setattr(tool, "WORTH_KEPT", tmp_path / "kept.json.gz")
        rows = [row(pipeline=name) for name in ("default", "air cut")]
        (tmp_path / "a.json").write_text(json.dumps(dict(commit="abc", rows=rows)))
        page = tmp_path / "page.md"
        page.write_text("<!-- worth -->\n<!-- end -->\n")
        call("worth", page, tmp_path / "a.json")
        filled = page.read_text()
        assert "commit abc" in filled
        assert "| without air cut |" in filled
        page.write_text("<!-- worth -->\n<!-- end -->\n")
        call("worth", page)  # of what is kept
        assert page.read_text() == filled

    def test_effects_go_behind_the_settings_of_a_page(self, parts, tmp_path):
        rows = [row(), row(variant="noise1_512", error=0.3)]
        rows += [row(pipeline="denoising"), row(pipeline="denoising", variant="noise1_512", error=0.5, topology=False)]
        page = tmp_path / "page.md"
        page.write_text("| a | 1 before<br>`RingBuilder.denoise=0`: ? |\n| b | `Refiner.limb=0`: old |\n")
        parts.ideas.write_effects(page, rows)
        told = "0.200 / 2 → 0.300 / 1; noise1_512: 0.300 / 1 → 0.500 / 0"
        expected = f"| a | 1 before<br>`RingBuilder.denoise=0`: {told} |\n| b | `Refiner.limb=0`: old |\n"
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
        for name in ("default", "cao2010", "wen2024"):
            assert name in printed
        assert "by cloud: means" in printed
        assert "by family" not in printed
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
        assert "| clean_512 | `default` | 3 | 0.33 [0.00, 1.00] |" in printed
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
        page.write_text("| `Refiner.limb=0`:  |")
        few = ("--builtin", "--shapes", "torus", "--variant", "clean_512", "--idea", "spurs cut", "--jobs", 0)
        call("ablation", *few, "--page", page)
        assert re.fullmatch(
            r"\| `Refiner.limb=0`: 0.\d+ / 1 → 0.\d+ / 1; clean_512: 0.\d+ / 1 → .* \|", page.read_text()
        )

    def test_settings(self, call, tmp_path):
        few = ("--builtin", "--shapes", "torus", "--pipeline", "default", "--jobs", 0, "-o", tmp_path / "out.json")
        settings = ("--set", "Contractor.max_iterations=1", "--set", "Refiner.limb=0")
        printed = call("truth", *few, "--variant", "clean_512,clean_300", *settings, "--markdown")
        rows = json.loads((tmp_path / "out.json").read_text())["rows"]
        assert [row["solves"] for row in rows] == [1, 1]
        assert re.search(r"\| all \| `default` \| 2 \| [01]\.", printed)

    def test_truth_of_random_shapes(self, call, zoo, tmp_path):
        saved = [tmp_path / "a.json", tmp_path / "b.json"]
        words = ("--variant", "*_512", "--pipeline", "default", "--markdown", "--jobs", 0)
        printed = call("truth", *zoo, *words, "-o", saved[0])
        assert "| clean_512 | `default` | 4 | 1.00 [1.00, 1.00] | 1.00 [1.00, 1.00] |" in printed
        assert "| rings | `default` | 6 | " in printed
        assert "| two | `default` | 1 | " in printed
        rows = json.loads(saved[0].read_text())["rows"]
        assert len(rows) == 8
        assert {row["family"] for row in rows} == {"rings", "big_rings", "two"}
        assert all(row["perfect"] and row["length"] == pytest.approx(1, abs=0.1) for row in rows)
        call("truth", *zoo, *words, "-o", saved[1], "--set", "Contractor.max_iterations=1")
        compared = call("compare", *saved, "--markdown")
        assert re.search(r"\| scan2_512 \| `default` \| 3 \| 1.00 → ", compared)
        assert re.search(r"\| all \| `default` \| 7 \| 1.00 → ", compared)
        same = call("compare", saved[0], saved[0], "--markdown")
        assert "| all | `default` | 7 | 1.00 → 1.00 | +0.00 [+0.00, +0.00] |" in same
        saved[1].write_text(json.dumps(dict(rows=[])))
        assert "no cloud and pipeline in common" in call("compare", *saved, code=2)

    def test_draws_of_built_in_shapes(self, call, tmp_path):
        few = ("--builtin", "--shapes", "torus", "--variant", "clean_300", "--pipeline", "default", "--jobs", 0)
        call("truth", *few, "--draws", 2, "-o", tmp_path / "out.json")
        rows = json.loads((tmp_path / "out.json").read_text())["rows"]
        assert [row["draw"] for row in rows] == [0, 1]
        assert rows[0]["error"] != rows[1]["error"]

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
        assert text.count("| clean_512 | `default` |") == text.count("|  | `wen2024` |") - 2 == 1
        assert text.count("| without ") == 2
        assert text.count("| rule |") == 2
        assert "old" not in text
        pictures = {path.stem: path.read_bytes() for path in (tmp_path / "images").iterdir()}
        assert set(pictures) == {"accuracy_clouds", "accuracy_ideas", "accuracy_solves"}
        call("page", page, *saved[::-1])
        assert page.read_text() == text
        random = json.loads(saved[0].read_text())
        for row in random["rows"]:
            row |= dict(family="rings", seed=0)
        (tmp_path / "random.json").write_text(json.dumps(random))
        call("page", page, *saved, tmp_path / "random.json")
        assert re.findall(r"\| (\S+) \| `default` \| (\d)", page.read_text()) == [
            *(("clean_512", "1"), ("noise1_512", "1"), ("all", "2"), ("built-in", "2"), ("rings", "2"))
        ]
        call("page", page, *saved)
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
