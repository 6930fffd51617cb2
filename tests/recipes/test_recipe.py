"""Recipes: round trips, what is refused, and recipes in reports."""

import dataclasses
import json
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import glsk_o3d as glsk
from glsk_o3d import Connector, Contractor, LPRReducer, Pipeline, RecipeError, Refiner, RingBuilder, pipelines, samples
from glsk_o3d.io.formats.fields import ARRAYS
from glsk_o3d.pipeline import Filter, recipe_of
from glsk_o3d.recipes import from_recipe, to_recipe

POINTS = samples.y_junction(n=500).points
HEAD = {"glsk_o3d": {"version": 1}}


# ---- round trips


def values(facts):
    """All legal values of a parameter."""
    kind = facts["type"].rstrip("?")
    low, high = facts["low"] if facts["low"] is not None else 0, facts["high"]
    numbers = st.floats(
        low, 1e100 if high is None else high, exclude_min=facts["open_low"], allow_nan=False, allow_infinity=False
    )
    integers = st.integers(int(low) + facts["open_low"], 2**63 - 1 if high is None else int(high))
    strategy = {
        "int": integers,
        "float": numbers | integers,
        "length": st.floats(1e-100, 1e100) | st.floats(0.001, 100).map(lambda share: f"{share:.6f}%"),
        "point": st.lists(numbers, min_size=3, max_size=3).map(lambda xyz: ",".join(map(repr, xyz))),
        "bool": st.booleans(),
        "stop": st.deferred(lambda: parts(glsk.ExplainedScore) | parts(glsk.RingSizeRatio)),
        "reducer": st.deferred(lambda: parts(LPRReducer)),
        "choice": st.nothing(),
    }[kind]
    words = facts["choices"] or (None,) * facts["type"].endswith("?")
    return strategy | st.sampled_from(words) if words else strategy


def parts(cls):
    return st.builds(cls, **{field.name: values(field.metadata) for field in dataclasses.fields(cls)})


PREPARING = (glsk.Sampler, glsk.OutlierRemover, glsk.Denoiser, glsk.Thinner)


@given(stages=st.tuples(*map(parts, (*PREPARING, RingBuilder, Contractor, LPRReducer, Contractor, Connector, Refiner))))
def test_every_parameter_of_every_filter_survives(stages):
    pipeline = Pipeline(*stages)
    recipe = to_recipe(pipeline)
    for again in (from_recipe(recipe), from_recipe(json.loads(json.dumps(recipe, allow_nan=False)))):
        assert again == pipeline
        assert repr(again) == repr(pipeline)  # 3 is not 3.0


def test_files(tmp_path):
    path = tmp_path / "räcipe.JSON"
    for make in pipelines.PIPELINES.values():
        glsk.save_recipe(make(), path)
        assert glsk.load_recipe(path) == glsk.load_recipe(str(path)) == make()
    assert [*tmp_path.iterdir()] == [path]


def test_a_recipe_is_a_table_per_stage():
    pipeline = RingBuilder(k=20) | Contractor(stop=glsk.RingSizeRatio(0.5)) | Connector(radius="3%")
    recipe = to_recipe(pipeline)
    assert list(recipe) == ["glsk_o3d", "pipeline"]
    builder, contractor, connector = recipe["pipeline"]
    assert builder == {"filter": "RingBuilder", **dataclasses.asdict(RingBuilder(k=20)), "radius": "none"}
    assert contractor["reducer"] == "none"
    assert from_recipe(one("Contractor", reducer=None)) == from_recipe(one("Contractor", reducer="none"))
    assert contractor["stop"] == {"rule": "RingSizeRatio", "threshold": 0.5}
    assert connector["radius"] == "3%"


# ---- refused

GOOD = {"filter": "RingBuilder"}


def with_stages(*tables):
    return {**HEAD, "pipeline": [*tables]}


def one(name, **options):
    return with_stages({"filter": name, **options})


WRONG = [  # where it is wrong, the words that help, and the recipe
    ("glsk_o3d.version", '{"glsk_o3d": {"version": 1}, "pipeline": [...]}', {"pipeline": [GOOD]}),
    ("glsk_o3d.version", "update", {"glsk_o3d": {"version": 2}, "stages": "in another form"}),
    ("", "not [{'filter': 'RingBuilder'}]", [GOOD]),
    ("piepline", "'pipeline'", {**HEAD, "piepline": [GOOD]}),
    ("pipeline", "is missing", HEAD),
    ("extends", "there are glsk_o3d, pipeline", {**with_stages(GOOD), "extends": "default"}),
    ("pipeline", "[]", with_stages()),
    ("pipeline[1]", '{"filter": NAME, ...}', with_stages(GOOD, "Contractor")),
    ("pipeline[1].filter", "'Contractor'", with_stages(GOOD, {"filter": "Contracter"})),
    ("pipeline[0].filter", "RingBuilder, Contractor, LPRReducer, Connector, Refiner", one("ExplainedScore")),
    ("pipeline[0].kk", "'k'", one("RingBuilder", kk=20)),
    ("pipeline[0].frame", "'spread', 'box'", one("Sampler", frame=["box"])),
    ("pipeline[0].reducer.phi", "above 0", one("Contractor", reducer={"filter": "LPRReducer", "phi": -1})),
    (
        "pipeline[0].reducer.filter",
        "there are Contractor, LPRReducer",
        one("Contractor", reducer={"filter": "Refiner"}),
    ),
    ("pipeline[0].stop.rule", "'RingSizeRatio'", one("Contractor", stop={"rule": "RingRatio"})),
    ("pipeline", "RingBuilder | Contractor | Connector | Refiner", with_stages(*[{"filter": "Connector"}] * 2)),
    ("pipeline[0].reducer", "a function", one("Contractor", reducer={"unwritten": "a function"})),
]


@pytest.mark.parametrize(("place", "words", "recipe"), WRONG, ids=range(len(WRONG)))
def test_wrong_recipes(tmp_path, place, words, recipe):
    with pytest.raises(RecipeError) as raised:
        from_recipe(recipe)
    assert str(raised.value).startswith(f"{place}: " if place else "")
    assert words in str(raised.value)
    path = tmp_path / "r.json"
    path.write_text(json.dumps(recipe))
    with pytest.raises(RecipeError) as in_file:
        glsk.load_recipe(path)
    assert str(in_file.value) == f"{path}: {raised.value}"


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("r.json", b'{"glsk_o3d": {"version": 1},\n "pipeline": [}', "JSON.* line 2"),
        ("r.json", b"\xff\xfe", "JSON"),
        ("r.json", b'{"a":' * 600 + b"1" + b"}" * 600, ""),
        ("r.toml", b"[glsk_o3d]", "recipes are .json files"),
    ],
)
def test_files_that_are_no_recipes(tmp_path, name, content, words):
    path = tmp_path / name
    with pytest.raises((FileNotFoundError, RecipeError)):
        glsk.load_recipe(path)
    path.write_bytes(content)
    with pytest.raises(RecipeError, match=f"^{re.escape(str(path))}: .*{words}"):
        glsk.load_recipe(path)


def thin(state):
    return state


@dataclasses.dataclass(frozen=True, kw_only=True)
class Homemade(Filter):
    consumes = produces = glsk.Contraction

    def run(self, state, context):
        return state


def never(iterations):
    return None


@pytest.mark.parametrize(
    ("stage", "place", "name", "key"),
    [
        (Contractor(reducer=thin), "pipeline[1].reducer", "thin", "unwritten"),
        (Contractor(stop=never), "pipeline[1].stop", "never", "unwritten"),
        (Contractor(reducer=Homemade()), "pipeline[1].reducer", "Homemade", "from"),
        (Homemade(), "pipeline[1]", "Homemade", "from"),
    ],
)
@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
def test_a_run_with_foreign_functions_has_a_recipe_that_cannot_be_read(tmp_path, stage, place, name, key):
    pipeline = RingBuilder() | stage | Connector() | Refiner()
    with pytest.raises(RecipeError, match=rf"^{re.escape(place)}.*{name}"):
        glsk.save_recipe(pipeline, tmp_path / "r.json")
    assert list(tmp_path.iterdir()) == []
    skeleton = pipeline(POINTS)
    glsk.save_skeleton(skeleton, tmp_path / "s.json")
    recipe = glsk.read_skeleton(tmp_path / "s.json").report.recipe
    assert recipe == skeleton.report.recipe
    table = recipe["pipeline"][1]
    assert key in (table[place.split(".")[1]] if "." in place else table)
    with pytest.raises(RecipeError, match=rf"^{re.escape(place)}.*{name}"):
        from_recipe(recipe)


def test_a_class_of_another_module_is_written_with_its_module():
    """The message of a missing plugin names it, and a class of the same name in another module is refused."""
    recipe = recipe_of(Homemade().table())
    assert recipe["pipeline"] == [{"filter": "Homemade", "from": __name__}]
    with pytest.raises(RecipeError, match=re.escape(f"install {__name__}")):
        from_recipe(recipe)
    assert from_recipe(one("LPRReducer", **{"from": "glsk_o3d.filters.lpr_reducer"})) == Pipeline(LPRReducer())
    with pytest.raises(RecipeError, match=rf"^pipeline\[0\]\.from: .*{re.escape(__name__)}"):
        from_recipe(one("LPRReducer", **{"from": __name__}))
    namesake = dataclasses.make_dataclass("Refiner", [], bases=(Homemade,), frozen=True, kw_only=True)
    with pytest.raises(RecipeError, match=r"^pipeline\[0\]\.from: 'Refiner' of types is not among"):
        to_recipe(Pipeline(namesake()))


def test_the_recipe_in_the_documentation(root):
    (block,) = re.findall(r"```json\n(.*?)```", (root / "docs" / "plugins.md").read_text(), re.DOTALL)
    assert from_recipe(json.loads(block)).stages[2].reducer == LPRReducer(phi=2e5)


# ---- what a report holds


@pytest.mark.parametrize(("name", "ending"), [("default", "json"), ("tree", "npz")])
def test_results_repeat_to_the_last_bit(tmp_path, name, ending):
    points = POINTS + np.array([1 / 3, 1e3, 0])
    points[[3, 200]] = [[np.nan, 0, 0], [0, np.inf, 0]]
    pipeline = pipelines.PIPELINES[name]().with_options(drop_invalid=True)
    skeleton = pipeline(points)
    assert from_recipe(skeleton.report.recipe) == pipeline
    assert skeleton.report.recipe == to_recipe(pipeline)
    glsk.save_skeleton(skeleton, tmp_path / f"s.{ending}")
    read = glsk.read_skeleton(tmp_path / f"s.{ending}")
    again = from_recipe(read.report.recipe)(read.points)
    for field in ARRAYS:
        np.testing.assert_array_equal(getattr(again, field), getattr(skeleton, field))
    assert again.report.recipe == read.report.recipe == skeleton.report.recipe
    if ending == "json":  # a result is a recipe too, but not an old one
        assert glsk.load_recipe(tmp_path / "s.json") == pipeline
        data = json.loads((tmp_path / "s.json").read_text())
        del data["report"]["recipe"]
        (tmp_path / "s.json").write_text(json.dumps(data))
        with pytest.raises(RecipeError, match=r"s\.json: a recipe is a table such as"):
            glsk.load_recipe(tmp_path / "s.json")


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
def test_a_run_that_the_caller_stopped_cannot_be_repeated():
    pipeline = RingBuilder() | Contractor(max_iterations=1) | Contractor() | Connector()
    stopped = glsk.skeletonize(POINTS, pipeline, on_iteration=lambda record: record.iteration < 3)
    assert [("unwritten" in stage) for stage in stopped.report.recipe["pipeline"]] == [False, False, True, True]
    with pytest.raises(RecipeError, match=r"^pipeline\[2\]: .*solve 3"):
        from_recipe(stopped.report.recipe)
    whole = glsk.skeletonize(POINTS, pipeline, on_iteration=lambda record: None)
    assert whole.report.recipe == to_recipe(pipeline)
