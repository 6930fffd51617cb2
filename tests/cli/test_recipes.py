"""Results as recipes of `glsk skeletonize`."""

import json

import numpy as np
import pytest

from glsk_o3d import load_recipe, read_skeleton, save_recipe
from glsk_o3d.recipes import to_recipe


@pytest.fixture
def made(invoke, scans, tmp_path):
    """A result, beside the recipe of its run."""
    words = ("--set", "Connector.radius=4%", "--drop-invalid")
    result = invoke("skeletonize", scans / "nan.ply", "-o", "s.json", *words)
    assert result.exit_code == 0, result.output
    save_recipe(load_recipe(tmp_path / "s.json"), tmp_path / "r.json")
    return read_skeleton(tmp_path / "s.json")


@pytest.mark.parametrize("recipe", ["r.json", "s.json"])
def test_a_run_is_repeated_by_its_recipe_or_that_in_its_result(invoke, scans, tmp_path, made, recipe):
    words = ("skeletonize", scans / "nan.ply", "--pipeline", recipe, "-o", "again.json")
    assert json.loads(invoke(*words, "--json").stdout)["files"] == ["again.json"]
    again = read_skeleton(tmp_path / "again.json")
    for name in ("vertices", "edges", "radii", "points", "vertex_of_point"):
        np.testing.assert_array_equal(getattr(again, name), getattr(made, name))
    assert again.report.recipe == made.report.recipe == to_recipe(load_recipe(tmp_path / "r.json"))
    assert invoke(*words, "--set", "Connector.radius=5%").exit_code == 0
    assert read_skeleton(tmp_path / "again.json").report.stages[6].startswith("Connector(radius='5%'")


def test_refused_before_anything_runs(refused, scans, tmp_path, made, no_run):
    data = json.loads((tmp_path / "s.json").read_text())
    data["report"]["recipe"]["pipeline"] = [{"filter": "Slab"}]
    (tmp_path / "gone.json").write_text(json.dumps(data))
    recipe = {"glsk_o3d": {"version": 1}, "pipeline": [{"filter": "RingBuilder", "k": 9}]}
    (tmp_path / "part.json").write_text(json.dumps(recipe))
    for code, words, message in (
        (1, "--pipeline gone.json -o a.ply", "gone.json: pipeline[0].filter: no filter is"),
        (2, "--pipeline s.json -o ./s.json", "is an input"),
        (1, "--pipeline none.json -o a.ply", "none.json: no such file"),
        (2, "--pipeline part.json -o a.ply", "not lead from a cloud to a skeleton"),
    ):
        assert message in refused(code, "skeletonize", scans / "sample.ply", *words.split())
