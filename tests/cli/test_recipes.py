"""The options of `glsk skeletonize` for recipes."""

import json

import numpy as np
import pytest

import glsk_o3d
from glsk_o3d import load_recipe, pipelines, read_skeleton
from glsk_o3d.recipes import to_recipe


@pytest.fixture
def made(invoke, scans, tmp_path):
    """A result, and the recipe of its run."""
    words = ("--set", "Connector.radius=4%", "--drop-invalid", "--save-recipe", "r.json")
    result = invoke("skeletonize", scans / "nan.ply", "-o", "s.json", "-o", "s.npz", *words)
    assert result.exit_code == 0, result.output
    assert result.stdout.endswith("wrote s.json\nwrote s.npz\nwrote r.json\n")
    return read_skeleton(tmp_path / "s.json")


@pytest.mark.parametrize("recipe", ["r.json", "s.json"])
def test_a_run_is_repeated_by_its_recipe_or_that_in_its_result(invoke, scans, tmp_path, made, recipe):
    words = ("skeletonize", scans / "nan.ply", "--pipeline", recipe, "-o", "again.json", "--save-recipe", "b.json")
    assert json.loads(invoke(*words, "--json").stdout)["files"] == ["again.json", "b.json"]
    again = read_skeleton(tmp_path / "again.json")
    for name in ("vertices", "edges", "radii", "points", "vertex_of_point"):
        np.testing.assert_array_equal(getattr(again, name), getattr(made, name))
    assert again.report.recipe == made.report.recipe == to_recipe(load_recipe(tmp_path / "b.json"))
    assert (tmp_path / "r.json").read_text() == (tmp_path / "b.json").read_text()
    assert invoke(*words, "--set", "Connector.radius=5%").exit_code == 0
    assert read_skeleton(tmp_path / "again.json").report.stages[6].startswith("Connector(radius='5%'")


def test_refused_before_anything_runs(refused, scans, tmp_path, made, no_run, monkeypatch):
    data = json.loads((tmp_path / "s.json").read_text())
    data["report"]["recipe"]["pipeline"][5]["reducer"] = {"unwritten": "a function"}
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
        (1, "skeletonize SCAN --pipeline gap.json -o a.ply", "gap.json: pipeline[5].reducer: a recipe cannot"),
        (1, "skeletonize SCAN --pipeline gone.json -o a.ply", "gone.json: pipeline[0].filter: no filter is"),
        (2, "skeletonize SCAN --pipeline r.json --save-recipe ./r.json -o a.ply", "is an input"),
        (2, "skeletonize SCAN --save-recipe a.json -o a.json", "a.json: is named twice"),
        (2, "skeletonize SCAN --save-recipe a.json", "nothing to write"),
        (1, "skeletonize SCAN --pipeline none.json -o a.ply", "none.json: No such file"),
        (1, "skeletonize SCAN --pipeline bad.json -o a.ply", "bad.json: pipeline[0].k: must be at least"),
        (2, "skeletonize SCAN --pipeline part.json -o a.ply", "not lead from a cloud to a skeleton"),
        (1, "skeletonize SCAN --pipeline odd -o a.ply --save-recipe a.json", "pipeline[1].reducer: a recipe cannot"),
    ):
        assert message in refused(code, *words.replace("SCAN", str(scans / "sample.ply")).split())
