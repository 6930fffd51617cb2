"""`glsk rerun`, and the options of `glsk skeletonize` for recipes."""

import dataclasses
import json
import re

import numpy as np
import pytest

import glsk_o3d
from glsk_o3d import load_recipe, pipelines, read_skeleton, save_skeleton
from glsk_o3d.recipes import to_recipe


@pytest.fixture
def made(invoke, scans, tmp_path):
    """A result, and the recipe of its run."""
    words = ("--set", "Connector.radius=4%", "--drop-invalid", "--save-recipe", "r.toml")
    result = invoke("skeletonize", scans / "nan.ply", "-o", "s.json", "-o", "s.npz", *words)
    assert result.exit_code == 0, result.output
    assert result.stdout.endswith("wrote s.json\nwrote s.npz\nwrote r.toml\n")
    return read_skeleton(tmp_path / "s.json")


def test_without_outputs_it_says_whether_it_is_the_same(invoke, scans, tmp_path, made):
    before = sorted(tmp_path.iterdir())
    result = invoke("rerun", "s.json")
    assert (result.exit_code, result.stderr) == (0, "")
    told = dict(line.split(maxsplit=1) for line in result.stdout.splitlines())
    assert (told["identical"], told["vertices"]) == ("yes", str(len(made.vertices)))
    assert "identical    no\n" in invoke("rerun", "s.json", scans / "ring.ply").stdout
    save_skeleton(dataclasses.replace(made, radii=made.radii * 2), tmp_path / "s.json")
    result = invoke("rerun", "s.json", "--json")
    assert json.loads(result.stdout)["identical"] is False
    assert "glsk: warning: the rerun differs from the result" in result.stderr
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("words", [["s.json"], ["s.npz"], ["s.json", "SCAN"]])
def test_identical(invoke, scans, tmp_path, made, words):
    words = [scans / "nan.ply" if word == "SCAN" else word for word in words]
    result = invoke("rerun", *words, "-o", "again.json", "--preview", "again.png", "--report", "s.html")
    assert (result.exit_code, result.stderr) == (0, "")
    again = read_skeleton(tmp_path / "again.json")
    for name in ("vertices", "edges", "radii", "points", "vertex_of_point"):
        np.testing.assert_array_equal(getattr(again, name), getattr(made, name))
    assert again.report.recipe == made.report.recipe
    assert (tmp_path / "again.png").stat().st_size > 1000
    text = (tmp_path / "s.html").read_text("utf-8")
    held = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])
    assert len(held["captions"]) == len(made.report.iterations) + 1  # the contraction was watched


def test_another_scan_and_its_recipe_from_a_file(invoke, scans, tmp_path, made):
    assert invoke("rerun", "s.npz", scans / "ring.ply", "-o", "a.json").exit_code == 0
    words = ("skeletonize", scans / "ring.ply", "--pipeline", "r.toml", "-o", "b.json")
    result = invoke(*words, "--save-recipe", "b.toml", "--json")
    assert json.loads(result.stdout)["files"] == ["b.json", "b.toml"]
    a, b = read_skeleton(tmp_path / "a.json"), read_skeleton(tmp_path / "b.json")
    np.testing.assert_array_equal(a.vertices, b.vertices)
    assert a.report.recipe == b.report.recipe == to_recipe(load_recipe(tmp_path / "b.toml"))
    assert (tmp_path / "r.toml").read_text() == (tmp_path / "b.toml").read_text()
    assert invoke(*words, "--set", "Connector.radius=5%").exit_code == 0
    assert read_skeleton(tmp_path / "b.json").report.stages[6].startswith("Connector(radius='5%'")


def test_refused_before_anything_runs(refused, scans, tmp_path, made, no_run, monkeypatch):
    save_skeleton(made, "s.ply")
    data = json.loads((tmp_path / "s.json").read_text())
    data["report"]["recipe"]["pipeline"][1]["reducer"] = {"unwritten": "a function"}
    (tmp_path / "gap.json").write_text(json.dumps(data))
    data["report"]["recipe"]["pipeline"] = [{"filter": "Slab"}]
    (tmp_path / "gone.json").write_text(json.dumps(data))
    for name, k in (("bad", 1), ("part", 9)):
        recipe = {"glsk_o3d": {"version": 1}, "pipeline": [{"filter": "RingBuilder", "k": k}]}
        (tmp_path / f"{name}.json").write_text(json.dumps(recipe))
    odd = glsk_o3d.Contractor(reducer=lambda state: state)
    odd = glsk_o3d.RingBuilder() | odd | glsk_o3d.Connector() | glsk_o3d.Refiner()
    monkeypatch.setitem(pipelines.PIPELINES, "odd", lambda: odd)
    for code, words, message in (
        (2, "rerun s.json -o s.json", "s.json: is an input: choose another name"),
        (1, "rerun s.ply", "s.ply: cannot be repeated: it holds no recipe"),
        (1, "rerun gap.json", "gap.json: cannot be repeated: pipeline[1].reducer: a recipe cannot"),
        (1, "rerun gone.json", "gone.json: cannot be repeated: pipeline[0].filter: no filter is"),
        (2, "skeletonize SCAN --pipeline r.toml --save-recipe ./r.toml -o a.ply", "is an input"),
        (1, "skeletonize SCAN --pipeline none.toml -o a.ply", "none.toml: No such file"),
        (1, "skeletonize SCAN --pipeline bad.json -o a.ply", "bad.json: pipeline[0].k: must be at least"),
        (2, "skeletonize SCAN --pipeline part.json -o a.ply", "not lead from a cloud to a skeleton"),
        (1, "skeletonize SCAN --pipeline odd -o a.ply --save-recipe a.json", "pipeline[1].reducer: a recipe cannot"),
    ):
        assert message in refused(code, *words.replace("SCAN", str(scans / "sample.ply")).split())
