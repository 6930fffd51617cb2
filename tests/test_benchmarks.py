"""The accuracy benchmark and the small ones: their clouds, their arithmetic, and their commands on tiny shapes."""

import json
import re
import sys
from itertools import chain

import numpy as np
import pytest
from glsk_studies import ablation, accuracy, axes, batch, clouds, crosscheck, options
from typer.testing import CliRunner

from glsk_o3d import Denoiser, OutlierRemover, Thinner, Tracer, pipelines
from glsk_o3d.apps.batch import run_batch
from glsk_o3d.cli.overrides import override
from glsk_o3d.samples import torus

STUDY = accuracy

FEW = ("--builtin", "--shapes", "torus", "--variant", "clean_512", "--jobs", 0)


def row(shape="torus", variant="clean_512", pipeline="default", **values):
    scores = dict(error=0.1, inside=1.0, completeness=1.0, length=1.0, ends=None, radius_error=0.05, cpu=0.2)
    scores |= dict(tips_f1=1.0, junctions_f1=1.0, components=0, loops=0, leaves=0, junctions=0)
    scores |= dict(topology=True, perfect=True, family="built-in", seed=None, draw=0)
    return dict(shape=shape, variant=variant, pipeline=pipeline) | scores | values


def failed(shape, variant="clean_512", pipeline="default", **values):
    """A row of what gave no skeleton."""
    kept = {name: value for name, value in row(**values).items() if name in ("family", "seed", "draw")}
    return dict(shape=shape, variant=variant, pipeline=pipeline, failure="ValueError: no") | kept


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


def test_clouds_of_folders_have_families_seeds_and_draws(zoo, capsys):
    cases = clouds.cases(zoo, False, "clean_512,scan2_512,depth2_512")
    facts = [(case.variant, *(case.facts[name] for name in ("family", "seed", "draw"))) for case in cases]
    rings = [("rings", 0, 0), ("rings", 1, 0), ("rings", 1, 1)]
    assert facts == [
        *(("clean_512", *it) for it in [*rings, ("big_rings", 7, 0), ("two", None, 0)]),
        *(("scan2_512", *it) for it in rings),  # of the others too little is seen
    ]
    assert [case.folder for case in cases[1:3]] == list(zoo)
    assert "scan2_512 of 2 shapes" in capsys.readouterr().err


class TestArithmetic:
    def test_differences_are_paired(self, capsys):
        names = [f"rings_{i}" for i in range(20)]
        before = [row(it, error=0.1 + 0.01 * i, topology=i < 10, seed=i) for i, it in enumerate(names)]
        after = [row(it, error=0.09 + 0.01 * i, topology=i not in (3, 19), seed=i) for i, it in enumerate(names)]
        after[0] = failed(names[0], seed=0)
        pairs = axes.paired([*before, row("gone")], after)
        assert capsys.readouterr().err == "left out: 1 clouds that only one file has\n"
        ((_, header, (line,)),) = axes.difference_tables(pairs)
        recorded = dict(zip(header[-2:], line[-2:], strict=True))
        assert recorded == {"now right": ", ".join(names[10:19]), "now wrong": "rings_0, rings_3"}
        assert line[:4] == ["clean_512", "`default`", "20", "0.50 → 0.85"]
        assert line[4].startswith("+0.35 [+0.05, +0.6")
        assert line[5] == "1.00 → 0.95"
        assert line[7:9] == ["0.200 → 0.190", "-0.010 [-0.010, -0.010]"]  # of the pairs that both have one

    def test_the_paper_has_what_ideas_are_worth(self, root):
        page = (root / "docs" / "differences.md").read_text(encoding="utf-8")
        assert f"<!-- worth -->\n\n{accuracy.worth_text()}" in page


def test_all_ideas_off_are_the_publications():
    off = {name: setting.split() for name, setting in ablation.IDEAS.items()}
    wen = chain.from_iterable(setting for name, setting in off.items() if name != "stop by score")
    idle = (OutlierRemover(outlier_factor=0), Denoiser(denoise=0), Thinner(thin_to="all", around=20))

    def with_idle(make):
        sampler, *others = make().stages
        return (sampler, *idle, *others, Tracer(surface=0))

    assert override(pipelines.default(), wen).stages == with_idle(pipelines.wen2024)
    absent = ("LPRReducer.", "ExplainedScore.")
    settings = (setting for setting in chain.from_iterable(off.values()) if not setting.startswith(absent))
    without = override(pipelines.default(), [*settings, "Contractor.reducer=none", "Contractor.max_iterations=20"])
    assert without.stages == with_idle(pipelines.cao2010)


class TestCommands:
    def test_truth_and_compare(self, call, zoo, tmp_path):
        saved = [tmp_path / "a.json", tmp_path / "b.json"]
        words = ("--variant", "*_512", "--pipeline", "default", "--markdown")
        printed = call("truth", *zoo, *words, "-o", saved[0], "--jobs", 1)
        assert "| clean_512 | `default` | 4 | 1.00 [1.00, 1.00] | 1.00 [1.00, 1.00] |" in printed
        assert "| rings | `default` | 6 | " in printed
        recorded = json.loads(saved[0].read_text())
        assert {"commit", "machine", "versions", "command"} < set(recorded)
        assert len(recorded["rows"]) == 8
        assert all(row["perfect"] and row["cpu"] > 0 for row in recorded["rows"])
        call("truth", *zoo, *words, "-o", saved[1], "--set", "Contractor.max_iterations=1", "--jobs", 0)
        assert {row["solves"] for row in json.loads(saved[1].read_text())["rows"]} == {1}
        compared = call("compare", *saved, "--markdown")
        assert re.search(r"\| scan2_512 \| `default` \| 3 \| 1.00 → ", compared)
        same = call("compare", saved[0], saved[0], "--markdown")
        assert "| all | `default` | 7 | 1.00 → 1.00 | +0.00 [+0.00, +0.00] |" in same

    def test_a_page_is_filled_and_has_its_pictures(self, call, tmp_path, monkeypatch):
        saved = [tmp_path / f"{command}.json" for command in ("truth", "ablation", "stop")]
        for path in saved:
            words = (path.stem, *FEW, *(("--idea", "spurs cut,thinning") if path.stem == "ablation" else ()))
            monkeypatch.setattr(sys, "argv", ["accuracy.py", *map(str, words)])  # so that the file says what it is
            call(*words, "-o", path)
        page = tmp_path / "page.md"
        page.write_text("".join(f"<!-- {path.stem} -->\nold\n<!-- end -->\n" for path in saved))
        call("page", page, *saved)
        text = page.read_text()
        assert "| clean_512 | `default` | 1 |" in text
        assert text.count("| without ") == 2
        assert "old" not in text
        pictures = {path.stem for path in (tmp_path / "images").iterdir()}
        assert pictures == {"accuracy_clouds", "accuracy_ideas", "accuracy_solves"}

    def test_wrong_usage_is_found_at_once(self, call):
        for wrong in (("--shapes", "teapot"), ("--set", "Refiner.magic=1"), ("-o", "no_such_folder/out.json")):
            assert "Invalid value" in call("truth", "--builtin", *wrong, code=2)


def test_a_cross_check_agrees_with_libigl():
    words = "verdicts --builtin --shapes tube,torus --variant clean_1500 --jobs 0"
    printed = CliRunner().invoke(crosscheck.app, words.split()).output
    assert "clean_1500 2 / 2 0 / 0 0 / 0" in " ".join(printed.split())


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")  # the work is done in this process
@pytest.mark.usefixtures("at_once")
def test_damaged_scans_fail_and_the_others_are_done(tmp_path):
    (tmp_path / "in").mkdir()
    batch.make_scans(tmp_path / "in", 3, 256, 400)
    result = run_batch(tmp_path / "in", tmp_path / "out")
    failed = {name[5:] for name, row in result.rows.items() if row["status"] == "failed"}
    assert failed == {name.partition(".")[0] for name in batch.CORRUPT}
    assert all(256 <= row["points"] <= 400 for row in result.rows.values() if row["status"] == "done")


def test_an_option_is_measured():
    measures = options.measure("`torus`", "Refiner.spacing=1", 0)
    assert (measures["topology"], measures["leaves"]) == (True, 0)
