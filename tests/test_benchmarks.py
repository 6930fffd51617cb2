"""The accuracy benchmark and the small ones: their clouds, their arithmetic, and their commands on tiny shapes."""

import json
import re
import sys
from itertools import chain

import numpy as np
import pytest
from glsk_studies import ablation, accuracy, axes, batch, clouds, crosscheck, options, sensitivity
from typer.testing import CliRunner

from glsk_o3d import Denoiser, OutlierRemover, Thinner, Tracer, pipelines, read_cloud
from glsk_o3d.apps.batch import run_batch
from glsk_o3d.cli.overrides import override
from glsk_o3d.samples import torus

STUDY = accuracy

FEW = ("--builtin", "--shapes", "torus", "--variant", "clean_512", "--jobs", 0)


def row(shape="torus", variant="clean_512", pipeline="default", **values):
    found = dict(error=0.1, inside=1.0, completeness=1.0, length=1.0, ends=None, radius_error=0.05, cpu=0.2)
    found |= dict(tips_f1=1.0, junctions_f1=1.0, components=0, loops=0, leaves=0, junctions=0)
    found |= dict(topology=True, perfect=True, family="built-in", seed=None, draw=0)
    return dict(shape=shape, variant=variant, pipeline=pipeline) | found | values


def failed(shape, variant="clean_512", pipeline="default", **values):
    """A row of what gave no skeleton."""
    kept = {name: value for name, value in row(**values).items() if name in ("family", "seed", "draw")}
    return dict(shape=shape, variant=variant, pipeline=pipeline, failure="ValueError: no") | kept


@pytest.mark.parametrize("kind", ["clean", "density", "holes", "outliers", "noise2", "scan2"])
def test_builtin_clouds_have_their_size_and_follow_from_their_draw(kind):
    for shape in clouds.BUILTIN:
        first, again, second = (clouds.builtin(shape, f"{kind}_300", draw)[0] for draw in (0, 0, 1))
        assert first.shape == (300, 3)
        np.testing.assert_array_equal(first, again)
        assert not (first == second).all(axis=1).any()


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
    def test_families_seeds_and_draws(self, zoo, capsys):
        found = clouds.cases(zoo, False, "clean_512,scan2_512,depth2_512")
        told = [(case.variant, *(case.facts[name] for name in ("family", "seed", "draw"))) for case in found]
        rings = [("rings", 0, 0), ("rings", 1, 0), ("rings", 1, 1)]
        assert told == [
            *(("clean_512", *it) for it in [*rings, ("big_rings", 7, 0), ("two", None, 0)]),
            *(("scan2_512", *it) for it in rings),  # of the others too little is seen
        ]
        assert [case.folder for case in found[1:3]] == list(zoo)
        assert capsys.readouterr().err == "left out: scan2_512 of 2 shapes\nleft out: depth2_512 of 4 shapes\n"

    def test_a_public_benchmark(self, small):
        found = clouds.cases(small.path, False, "*")
        assert {(case.shape, case.variant) for case in found} == {(it.shape, it.variant) for it in small.scored}
        points, axis = found[0].load()
        np.testing.assert_array_equal(points, read_cloud(small.scored[0].path).points)
        assert len(axis.radii) == 3
        assert (found[0].size, found[0].facts["family"], found[0].facts["seed"]) == (len(points), "trees", 100)


class TestArithmetic:
    def test_differences_are_paired(self, capsys):
        names = [f"rings_{i}" for i in range(20)]
        before = [row(it, error=0.1 + 0.01 * i, topology=i < 10, seed=i) for i, it in enumerate(names)]
        after = [row(it, error=0.09 + 0.01 * i, topology=i not in (3, 19), seed=i) for i, it in enumerate(names)]
        after[0] = failed(names[0], seed=0)
        pairs = axes.paired([*before, row("gone")], after)
        assert capsys.readouterr().err == "left out: 1 clouds that only one file has\n"
        ((_, header, (line,)),) = axes.difference_tables(pairs)
        told = dict(zip(header[-2:], line[-2:], strict=True))
        assert told == {"now right": ", ".join(names[10:19]), "now wrong": "rings_0, rings_3"}
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
    left = (setting for setting in chain.from_iterable(off.values()) if not setting.startswith(absent))
    without = override(pipelines.default(), [*left, "Contractor.reducer=none", "Contractor.max_iterations=20"])
    assert without.stages == with_idle(pipelines.cao2010)


class TestCommands:
    def test_truth_and_compare(self, call, zoo, tmp_path):
        saved = [tmp_path / "a.json", tmp_path / "b.json"]
        words = ("--variant", "*_512", "--pipeline", "default")
        printed = call("truth", *zoo, *words, "-o", saved[0], "--jobs", 1)
        assert "| clean_512 | `default` | 4 | 1.00 [1.00, 1.00] | 1.00 [1.00, 1.00] |" in printed
        assert "| rings | `default` | 6 | " in printed
        told = json.loads(saved[0].read_text())
        assert {"commit", "machine", "versions", "command"} < set(told)
        assert len(told["rows"]) == 8
        assert all(row["perfect"] and row["cpu"] > 0 for row in told["rows"])
        call("truth", *zoo, *words, "-o", saved[1], "--set", "Contractor.max_iterations=1", "--jobs", 0)
        assert {row["solves"] for row in json.loads(saved[1].read_text())["rows"]} == {1}
        compared = call("compare", *saved)
        assert re.search(r"\| scan2_512 \| `default` \| 3 \| 1.00 → ", compared)
        same = call("compare", saved[0], saved[0])
        assert "| all | `default` | 7 | 1.00 → 1.00 | +0.00 [+0.00, +0.00] |" in same

    def test_a_page_and_its_pictures(self, call, tmp_path, monkeypatch):
        saved = [tmp_path / f"{command}.json" for command in ("truth", "ablation", "stop")]
        effects = tmp_path / "effects.md"
        effects.write_text("| `Refiner.limb=0`:  |")
        for path in saved:
            idea = ("--idea", "spurs cut,thinning", "--page", effects) if path.stem == "ablation" else ()
            words = (path.stem, *FEW, *idea)
            monkeypatch.setattr(sys, "argv", ["accuracy.py", *map(str, words)])  # so that the file says what it is
            call(*words, "-o", path)
        assert re.fullmatch(r"\| `Refiner.limb=0`: 0.\d+ / 1 → 0.\d+ / 1; clean_512: .* \|", effects.read_text())
        page = tmp_path / "page.md"
        page.write_text("".join(f"<!-- {path.stem} -->\nold\n<!-- end -->\n" for path in saved))
        call("page", page, *saved)
        text = page.read_text()
        assert "| clean_512 | `default` | 1 |" in text
        assert text.count("| without ") == 2
        assert "old" not in text
        pictures = {path.stem for path in (tmp_path / "images").iterdir()}
        assert pictures == {"accuracy_clouds", "accuracy_ideas", "accuracy_solves"}
        page.write_text("<!-- worth -->\n<!-- end -->\n")
        monkeypatch.setattr(accuracy, "WORTH_KEPT", tmp_path / "kept.json.gz")
        call("worth", page, saved[1])
        assert "| without thinning |" in page.read_text()

    def test_rotations_and_mass(self, call, tmp_path):
        out = tmp_path / "out.json"
        call("rotations", *FEW, "--count", 1, "-o", out)
        (found,) = json.loads(out.read_text())["rows"]
        assert (found["runs"], found["topology_changes"], len(found["moves"])) == (1, 0, 1)
        assert found["moves"][0] < 0.5
        assert "| mean | " in call("mass", *FEW)

    def test_wrong_usage_is_found_at_once(self, call):
        for wrong in (("--shapes", "teapot"), ("--set", "Refiner.magic=1"), ("-o", "no_such_folder/out.json")):
            assert "Invalid value" in call("truth", "--builtin", *wrong, code=2)


def test_cross_checks():
    words = "verdicts --builtin --shapes tube,torus --variant clean_1500 --jobs 0"
    printed = CliRunner().invoke(crosscheck.app, words.split()).output
    assert "clean_1500 | 2 / 2 | 0 / 0 | 0 / 0 |" in printed


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")  # the work is done in this process
@pytest.mark.usefixtures("at_once")
def test_scans_for_batches(tmp_path):
    (tmp_path / "in").mkdir()
    batch.make_scans(tmp_path / "in", 3, 256, 400)
    result = run_batch(tmp_path / "in", tmp_path / "out")
    failed = {name[5:] for name, row in result.rows.items() if row["status"] == "failed"}
    assert failed == {name.partition(".")[0] for name in batch.CORRUPT}
    assert all(256 <= row["points"] <= 400 for row in result.rows.values() if row["status"] == "done")


def test_measures_of_options():
    found = options.measure("`torus`", "Refiner.spacing=1", 0)
    assert (found["topology"], found["leaves"]) == (True, 0)


@pytest.mark.parametrize(
    "kind", ["Refiner", "curve/topology/loops", "curve/numbers", "geometry/winding", "filters/thinner"]
)
def test_a_number_is_changed_while_it_is_measured(kind):
    """An option, a weight, a field of a step, or a constant."""
    pipelines.default()(torus(300).points)  # so that all modules are there
    numbers = [number for number in sensitivity.steering() if number.place == kind]
    first = repr(pipelines.default())
    for number in numbers:
        before = values(number)
        with sensitivity.changed(number.place, number.name, number.value, 1.25) as pipeline:
            assert kind != "Refiner" or repr(pipeline) != first
            assert kind == "Refiner" or all(
                now > was for now, was in zip(map(abs, values(number)), map(abs, before), strict=True)
            )
        assert values(number) == before
    assert numbers


def values(number):
    """What a number is now, as often as it is kept."""
    if ": " in number.name:
        about, fact = number.name.split(": ")
        return [next(it for it in sensitivity.QUESTIONS if it.about == about).weights[fact]]
    if number.place[0].isupper():
        return []
    module = vars(sys.modules[f"glsk_o3d.{number.place.replace('/', '.')}"])
    steps = [value for value in module.values() if number.name in getattr(value, "__dict__", {})]
    return [getattr(step, number.name) for step in steps if not isinstance(step, type)] or [module[number.name]]
