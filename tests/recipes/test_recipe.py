"""Recipes: round trips, what is refused and how, what a report holds, and rerun."""

import dataclasses
import json
import re

import numpy as np
import pytest
import tomlkit
from hypothesis import given
from hypothesis import strategies as st

import glsk_o3d as glsk
from glsk_o3d import (
    Connector,
    Contraction,
    Contractor,
    ExplainedScore,
    InvalidParameterError,
    LPRReducer,
    Pipeline,
    RecipeError,
    Refiner,
    RingBuilder,
    RingSizeRatio,
    SkeletonWarning,
    load_recipe,
    pipelines,
    rerun,
    samples,
    save_recipe,
    skeletonize,
)
from glsk_o3d.pipeline import Filter, after, recipe_of, with_stage
from glsk_o3d.recipes import from_recipe, to_recipe
from glsk_o3d.recipes.catalogue import BUILTIN
from glsk_o3d.report import Report

POINTS = samples.y_junction(n=500).points
HEAD = {"glsk_o3d": {"version": 1}}


# ---- round trips


def values(facts):
    """All legal values of a parameter."""
    kind = facts["type"].rstrip("?")
    low, high = facts["low"] if facts["low"] is not None else 0, facts["high"]
    numbers = st.floats(low, high, exclude_min=facts["open_low"], allow_nan=False, allow_infinity=False)
    integers = st.integers(int(low) + facts["open_low"], high if high is None else int(high))
    strategy = {
        "int": integers,
        "float": numbers | integers,
        "length": numbers | st.floats(0.001, 100).map(lambda share: f"{share:.6f}%"),
        "bool": st.booleans(),
        "stop": st.deferred(lambda: parts(ExplainedScore) | parts(RingSizeRatio)),
        "reducer": st.deferred(lambda: parts(LPRReducer)),
        "choice": st.nothing(),
    }[kind]
    return (
        strategy | st.sampled_from(facts["choices"] or (None,))
        if facts["choices"] or facts["type"].endswith("?")
        else strategy
    )


def parts(cls):
    return st.builds(cls, **{field.name: values(field.metadata) for field in dataclasses.fields(cls)})


def stages(*classes):
    return st.tuples(*map(parts, classes)).map(lambda made: Pipeline(*made))


@given(pipeline=stages(RingBuilder, Contractor, LPRReducer, Contractor, Connector, Refiner, Refiner))
def test_every_parameter_of_every_filter_survives(pipeline):
    recipe = to_recipe(pipeline)
    for again in (
        from_recipe(recipe),
        from_recipe(json.loads(json.dumps(recipe, allow_nan=False))),
        from_recipe(tomlkit.parse(tomlkit.dumps(recipe)).unwrap()),
    ):
        assert again == pipeline
        assert repr(again) == repr(pipeline)  # 3 is not 3.0


def test_the_round_trip_is_over_everything():
    """So that a new filter is not forgotten above."""
    assert set(BUILTIN.values()) == {
        *(RingBuilder, Contractor, LPRReducer, Connector, Refiner, ExplainedScore, RingSizeRatio)
    }


@pytest.mark.parametrize("ending", ["json", "toml", "JSON"])
@pytest.mark.parametrize("name", pipelines.PIPELINES)
def test_files(tmp_path, name, ending):
    pipeline, path = pipelines.PIPELINES[name](), tmp_path / f"räcipe.{ending}"
    save_recipe(pipeline, path)
    assert load_recipe(path) == load_recipe(str(path)) == pipeline
    save_recipe(pipeline, tmp_path / "again.json")
    assert [each.name for each in sorted(tmp_path.iterdir())] == ["again.json", path.name]


def test_what_a_recipe_looks_like():
    pipeline = RingBuilder(k=20) | Contractor(stop=RingSizeRatio(0.5)) | Connector(radius="3%")
    recipe = to_recipe(pipeline)
    assert list(recipe) == ["glsk_o3d", "pipeline"]
    builder, contractor, connector = recipe["pipeline"]
    assert builder == {"filter": "RingBuilder", **vars(RingBuilder(k=20)), "radius": "none"}
    assert contractor["reducer"] == "none"
    assert contractor["stop"] == {"rule": "RingSizeRatio", "threshold": 0.5}
    assert connector["radius"] == "3%"


def test_values_of_other_types_are_written_as_plain_ones():
    pipeline = Pipeline(RingBuilder(k=np.int64(20), outlier_factor=np.float32(2.5), frame=np.str_("box")))
    recipe = to_recipe(pipeline)
    assert {type(value) for value in recipe["pipeline"][0].values()} == {str, int, float, bool}
    assert from_recipe(json.loads(json.dumps(recipe))) == pipeline


def test_what_is_left_out_has_its_default():
    recipe = {
        **HEAD,
        "pipeline": [{"filter": "Contractor", "reducer": {"filter": "LPRReducer", "phi": 2}, "max_iterations": 3}],
    }
    assert from_recipe(recipe) == Pipeline(Contractor(reducer=LPRReducer(phi=2), max_iterations=3))
    for nothing in (None, "none"):
        recipe["pipeline"][0]["reducer"] = nothing
        assert from_recipe(recipe).stages[0].reducer is None


# ---- a named pipeline with changes


def test_extends(tmp_path):
    text = """
        extends = "default"
        glsk_o3d.version = 1
        [set.RingSizeRatio]
        threshold = 0.5
        [set.Contractor]
        stop.rule = "RingSizeRatio"
        max_iterations = 7
        [set.LPRReducer]
        phi = 3e5
        [set.Connector]
        radius = "4%"
    """
    (tmp_path / "r.toml").write_text(text)
    builder, _, _, refiner = pipelines.default().stages
    contractor = Contractor(reducer=LPRReducer(phi=3e5), stop=RingSizeRatio(0.5), max_iterations=7)
    assert load_recipe(tmp_path / "r.toml") == builder | contractor | Connector(radius="4%") | refiner
    for name, make in pipelines.PIPELINES.items():
        assert from_recipe({**HEAD, "extends": name}) == make()


# ---- refused

GOOD = {"filter": "RingBuilder"}
WRONG = {
    'glsk_o3d.version: is missing; a recipe is a table such as {"glsk_o3d": {"version": 1}, "pipeline": [...]}': {
        "pipeline": [GOOD]
    },
    "glsk_o3d.version: is 2 and this release reads 1: update glsk-o3d": {
        "glsk_o3d": {"version": 2},
        "stages": "of whatever shape",
    },
    "glsk_o3d.extra: there is only 'version' in this table": {
        "glsk_o3d": {"version": 1, "extra": 4},
        "pipeline": [GOOD],
    },
    "glsk_o3d.version: must be 1, not '1'": {"glsk_o3d": {"version": "1"}, "pipeline": [GOOD]},
    "a recipe is a table such as "
    '{"glsk_o3d": {"version": 1}, "pipeline": [...]}, not [{\'filter\': \'RingBuilder\'}]': [GOOD],
    "piepline: no key of a recipe is called 'piepline': did you mean 'pipeline'?": {**HEAD, "piepline": [GOOD]},
    "a recipe has either 'pipeline' or 'extends', and this one lacks both": HEAD,
    "a recipe has either 'pipeline' or 'extends', and this one has both": {
        **HEAD,
        "pipeline": [GOOD],
        "extends": "default",
    },
    "pipeline: must be a list of at least one stage, not []": {**HEAD, "pipeline": []},
    "pipeline: must be a list of at least one stage, not {'filter': 'RingBuilder'}": {**HEAD, "pipeline": GOOD},
    "pipeline[1]: must be a table such as {\"filter\": NAME, ...}, not 'Contractor'": {
        **HEAD,
        "pipeline": [GOOD, "Contractor"],
    },
    "pipeline[1].filter: no filter is called 'Contracter': did you mean 'Contractor'? "
    "(or install the plugin that it is from)": {
        **HEAD,
        "pipeline": [GOOD, {"filter": "Contracter"}],
    },
    "pipeline[0].filter: no filter is called 'ExplainedScore': "
    "there are RingBuilder, Contractor, LPRReducer, Connector, Refiner": {
        **HEAD,
        "pipeline": [{"filter": "ExplainedScore"}],
    },
    "pipeline[0].kk: no parameter of RingBuilder is called 'kk': did you mean 'k'?": {
        **HEAD,
        "pipeline": [{"filter": "RingBuilder", "kk": 20}],
    },
    "pipeline[0].k: must be an int, or 'auto', or 'published', not 7.5": {
        **HEAD,
        "pipeline": [{"filter": "RingBuilder", "k": 7.5}],
    },
    "pipeline[0].drop_invalid: must be True or False, not 'yes'": {
        **HEAD,
        "pipeline": [{"filter": "RingBuilder", "drop_invalid": "yes"}],
    },
    "pipeline[0].frame: must be one of 'spread', 'box', not ['box']": {
        **HEAD,
        "pipeline": [{"filter": "RingBuilder", "frame": ["box"]}],
    },
    "pipeline[0].radius: a percentage of the diagonal lies above 0% and up to 100%, not '200%'": {
        **HEAD,
        "pipeline": [{"filter": "Connector", "radius": "200%"}],
    },
    "pipeline[0].outlier_factor: must be finite, not nan": {
        **HEAD,
        "pipeline": [{"filter": "RingBuilder", "outlier_factor": float("nan")}],
    },
    "pipeline[1].reducer.phi: must be above 0, not -1": {
        **HEAD,
        "pipeline": [GOOD, {"filter": "Contractor", "reducer": {"filter": "LPRReducer", "phi": -1}}],
    },
    "pipeline[0].reducer.filter: no reducer is called 'Refiner': there are Contractor, LPRReducer": {
        **HEAD,
        "pipeline": [{"filter": "Contractor", "reducer": {"filter": "Refiner"}}],
    },
    "pipeline[0].stop: must be a table such as {\"rule\": NAME, ...}, not {'filter': 'RingSizeRatio'}": {
        **HEAD,
        "pipeline": [{"filter": "Contractor", "stop": {"filter": "RingSizeRatio"}}],
    },
    "pipeline[0].stop.rule: no stopping rule is called 'RingRatio': did you mean 'RingSizeRatio'? "
    "(or install the plugin that it is from)": {
        **HEAD,
        "pipeline": [{"filter": "Contractor", "stop": {"rule": "RingRatio"}}],
    },
    "pipeline: Connector takes a Contraction but Connector gives a Skeleton: "
    "the order is RingBuilder | Contractor | Connector | Refiner": {
        **HEAD,
        "pipeline": [{"filter": "Connector"}, {"filter": "Connector"}],
    },
    "pipeline[0].reducer: a recipe cannot hold it: a function": {
        **HEAD,
        "pipeline": [{"filter": "Contractor", "reducer": {"unwritten": "a function"}}],
    },
    "extends: no pipeline is called 'best': there are default, wen2024, cao2010": {**HEAD, "extends": "best"},
    "set: changes the pipeline that 'extends' names, and there is no 'extends'": {
        **HEAD,
        "pipeline": [GOOD],
        "set": {},
    },
    "set.Connecter: no filter or rule is called 'Connecter': did you mean 'Connector'?": {
        **HEAD,
        "extends": "default",
        "set": {"Connecter": {"radius": 1}},
    },
    "set.Connector.radios: no parameter of Connector is called 'radios': did you mean 'radius'?": {
        **HEAD,
        "extends": "default",
        "set": {"Connector": {"radios": 1}},
    },
    "set.Connector: must be a table of parameters, not 5": {**HEAD, "extends": "default", "set": {"Connector": 5}},
    "set: must be a table of filters, not 5": {**HEAD, "extends": "default", "set": 5},
    "set: LPRReducer.phi: LPRReducer is not in the pipeline, which has "
    "RingBuilder, Contractor, RingSizeRatio, Connector, Refiner": {
        **HEAD,
        "extends": "cao2010",
        "set": {"LPRReducer": {"phi": 1}},
    },
}


@pytest.mark.parametrize(("message", "recipe"), WRONG.items(), ids=range(len(WRONG)))
def test_wrong_recipes(tmp_path, message, recipe):
    with pytest.raises(RecipeError) as raised:
        from_recipe(recipe)
    assert str(raised.value) == message
    path = tmp_path / "r.json"
    path.write_text(json.dumps(recipe))
    with pytest.raises(RecipeError) as raised:
        skeletonize(POINTS, path)
    assert str(raised.value) == f"{path}: {message}"


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        (
            "r.json",
            b'{"glsk_o3d": {"version": 1},\n "pipeline": [}',
            "not valid JSON: Expecting value: line 2 column",
        ),
        ("r.json", b"", "not valid JSON: Expecting value: line 1 column 1"),
        ("r.json", b'{"a": 1, "b": {"k": 1, "k": 2}}', "not valid JSON: the key 'k' stands twice in one table"),
        ("r.json", b"\xff\xfe", "not valid JSON: 'utf-8' codec can't decode byte 0xff"),
        ("r.json", b"[" * 100_000, "not valid JSON: "),
        ("r.json", b'{"a":' * 600 + b"1" + b"}" * 600, ""),
        ("r.toml", b"[glsk_o3d]\nversion = ", "not valid TOML: "),
        ("r.toml", b"[glsk_o3d]\nversion = 1\nversion = 1", 'not valid TOML: Key "version" already exists'),
        ("r.toml", b"", "glsk_o3d.version: is missing"),
        ("r.yaml", b"glsk_o3d:", "unknown ending; recipes are .json or .toml files"),
    ],
)
def test_files_that_are_no_recipes(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(RecipeError, match=re.escape(f"{path}: {message}")):
        load_recipe(path)


def test_a_byte_order_mark_is_no_mistake(tmp_path):
    (tmp_path / "r.json").write_bytes(b"\xef\xbb\xbf" + json.dumps({**HEAD, "extends": "default"}).encode())
    assert load_recipe(tmp_path / "r.json") == pipelines.default()


def test_files_that_are_not_there(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_recipe(tmp_path / "none.json")
    with pytest.raises(FileNotFoundError):
        skeletonize(POINTS, "none.json")
    with pytest.raises(RecipeError, match=r"none: unknown ending"):
        skeletonize(POINTS, tmp_path / "none")  # a path is never a name
    with pytest.raises(FileNotFoundError, match="no such folder"):
        save_recipe(pipelines.default(), tmp_path / "no" / "r.json")


def thin(state):
    return state


@dataclasses.dataclass(frozen=True, kw_only=True)
class Homemade(Filter):
    consumes = produces = Contraction

    def _run(self, state, watch):
        return state


def never(iterations):
    return None


UNWRITABLE = {
    "reducer": (Contractor(reducer=thin), "pipeline[1].reducer", "thin", "unwritten"),
    "rule": (Contractor(stop=never), "pipeline[1].stop", "never", "unwritten"),
    "filter inside": (Contractor(reducer=Homemade()), "pipeline[1].reducer", "Homemade", "from"),
    "stage": (Homemade(), "pipeline[1]", "Homemade", "from"),
}


@pytest.mark.parametrize(("stage", "place", "name", "key"), UNWRITABLE.values(), ids=UNWRITABLE)
@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
def test_what_no_recipe_can_hold_breaks_no_run(tmp_path, stage, place, name, key):
    pipeline = RingBuilder() | stage | Connector() | Refiner()
    with pytest.raises(RecipeError, match=rf"^{re.escape(place)}: .*\.{name}"):
        save_recipe(pipeline, tmp_path / "r.json")
    assert list(tmp_path.iterdir()) == []
    skeleton = pipeline(POINTS)
    skeleton.save(tmp_path / "s.json")
    recipe = glsk.read_skeleton(tmp_path / "s.json").report.recipe
    assert recipe == skeleton.report.recipe
    table = recipe["pipeline"][1]
    for field in place.split(".")[1:]:
        table = table[field]
    assert key in table
    with pytest.raises(RecipeError, match=rf"^{re.escape(place)}.*{name}"):
        rerun(skeleton)


def test_a_class_of_another_module_is_named_with_it():
    """So that who lacks the plugin knows it, and a namesake is not taken for it."""
    recipe = recipe_of(Homemade().table())
    assert recipe["pipeline"] == [{"filter": "Homemade", "from": __name__}]
    with pytest.raises(RecipeError, match=re.escape(f"install {__name__}")):
        from_recipe(recipe)
    for module, right in (("glsk_o3d.lpr_reducer", True), (__name__, False)):
        recipe = recipe_of({"filter": "LPRReducer", "from": module})
        if right:
            assert from_recipe(recipe) == Pipeline(LPRReducer())
        else:
            with pytest.raises(RecipeError, match=rf"^pipeline\[0\]\.from: .*{re.escape(module)}"):
                from_recipe(recipe)


def test_a_namesake_is_not_written():
    namesake = dataclasses.make_dataclass("Refiner", [], bases=(Homemade,), frozen=True, kw_only=True)
    with pytest.raises(RecipeError, match=r"^pipeline\[0\]: .*Refiner"):
        to_recipe(Pipeline(namesake()))


def test_a_wrong_parameter_is_not_written(tmp_path):
    with pytest.raises(InvalidParameterError, match=r"RingBuilder\.k = 1"):
        save_recipe(Pipeline(RingBuilder(k=1)), tmp_path / "r.json")
    assert list(tmp_path.iterdir()) == []


def test_the_documentation(root, install):
    text = (root / "docs" / "recipes.md").read_text()
    written = [json.loads(block) for block in re.findall(r"```json\n(.*?)```", text, re.DOTALL)]
    written += [tomlkit.parse(block).unwrap() for block in re.findall(r"```toml\n(.*?)```", text, re.DOTALL)]
    first, same, extended = map(from_recipe, written)
    assert first == same
    assert extended.stages[1].stop == RingSizeRatio(0.02)

    text = (root / "docs" / "plugins.md").read_text()
    (code,), (entries,) = (re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL) for kind in ("python", "toml"))
    groups = tomlkit.parse(entries).unwrap()["project"]["entry-points"]
    install("glsk-slab", "0.1", code, "".join(f"[{g}]\n{n} = {v}\n" for g, e in groups.items() for n, v in e.items()))
    points = np.concatenate([POINTS, POINTS + [0, 0, 9]])
    assert skeletonize(points, "slab").report.n_input == (np.abs(points[:, 2] - 0.5) <= 0.5).sum() > 0


# ---- what a report holds, and rerun


@pytest.mark.parametrize("name", pipelines.PIPELINES)
@pytest.mark.parametrize("ending", ["json", "npz"])
def test_results_repeat_to_the_last_bit(tmp_path, name, ending):
    points = POINTS + np.array([1 / 3, 1e3, 0])
    points[[3, 200]] = [[np.nan, 0, 0], [0, np.inf, 0]]
    named = pipelines.PIPELINES[name]()
    pipeline = dataclasses.replace(named.stages[0], drop_invalid=True) | Pipeline(*named.stages[1:])
    skeleton = pipeline(points)
    assert from_recipe(skeleton.report.recipe) == pipeline
    assert skeleton.report.recipe == to_recipe(pipeline)
    skeleton.save(tmp_path / f"s.{ending}")
    read = glsk.read_skeleton(tmp_path / f"s.{ending}")
    assert read.report.recipe == skeleton.report.recipe
    for again in (rerun(read), rerun(read, points), rerun(rerun(skeleton))):
        for field in ("vertices", "edges", "radii", "confidence", "vertex_of_point", "points", "normals"):
            np.testing.assert_array_equal(getattr(again, field), getattr(skeleton, field))
        assert again.report.recipe == skeleton.report.recipe


def test_results_composed_by_hand_have_the_same_recipe():
    pipeline = RingBuilder() | Contractor(max_iterations=1) | LPRReducer() | Contractor() | Connector() | Refiner()
    by_hand = POINTS
    for stage in pipeline.stages:
        by_hand = stage(by_hand)
    assert by_hand.report.recipe == pipeline(POINTS).report.recipe == to_recipe(pipeline)
    np.testing.assert_array_equal(rerun(by_hand).vertices, by_hand.vertices)


def test_on_another_cloud():
    other = samples.torus(n=400).points
    skeleton = skeletonize(POINTS, "wen2024")
    np.testing.assert_array_equal(rerun(skeleton, other).vertices, skeletonize(other, "wen2024").vertices)


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
def test_a_run_that_the_caller_stopped_cannot_be_repeated():
    pipeline = RingBuilder() | Contractor(max_iterations=1) | Contractor() | Connector()
    stopped = skeletonize(POINTS, pipeline, on_iteration=lambda record: record.iteration < 3)
    assert [("unwritten" in stage) for stage in stopped.report.recipe["pipeline"]] == [False, False, True, True]
    with pytest.raises(RecipeError, match=r"^pipeline\[2\]: .* stopped by the caller after solve 3$"):
        rerun(stopped)
    whole = skeletonize(POINTS, pipeline, on_iteration=lambda record: None)
    assert whole.report.recipe == to_recipe(pipeline)


def test_progress_of_a_rerun():
    skeleton, told, begun = skeletonize(POINTS), [], []
    rerun(skeleton, on_iteration=told.append, on_stage=begun.append)
    assert len(told) == len(skeleton.report.iterations)
    assert tuple(begun) == pipelines.default().stages


def test_a_result_that_others_made_differs():
    skeleton = skeletonize(POINTS)
    old = {**skeleton.report.versions, "numpy": "1.0"}
    moved = dataclasses.replace(
        skeleton, vertices=skeleton.vertices + 1e-15, report=dataclasses.replace(skeleton.report, versions=old)
    )
    with pytest.warns(SkeletonWarning, match=f"^the rerun differs .* made with numpy 1.0 instead of {np.__version__}$"):
        rerun(moved)


def test_old_results_load_but_have_no_recipe(tmp_path):
    skeletonize(POINTS).save(tmp_path / "s.json")
    data = json.loads((tmp_path / "s.json").read_text())
    del data["report"]["recipe"]
    (tmp_path / "old.json").write_text(json.dumps(data))
    old = glsk.read_skeleton(tmp_path / "old.json")
    assert old.report.stages
    assert old.report.recipe == {}
    with pytest.raises(RecipeError, match=r"^it holds no recipe"):
        rerun(old)
    old.save(tmp_path / "s.ply")
    with pytest.raises(RecipeError, match=r"^it holds no recipe"):
        rerun(glsk.read_skeleton(tmp_path / "s.ply"))


def test_results_that_do_not_start_from_a_cloud(tmp_path):
    skeletonize(POINTS).save(tmp_path / "s.ply")
    refined = Refiner(recentre=0, spacing=0, twig=0, opening=0, weak=0, sure=0)(glsk.read_skeleton(tmp_path / "s.ply"))
    with pytest.raises(RecipeError, match=r"^pipeline: Refiner\(.* does not lead from a cloud to a skeleton$"):
        rerun(refined)


def test_results_without_their_points():
    skeleton = dataclasses.replace(skeletonize(POINTS), points=np.empty((0, 3)))
    with pytest.raises(RecipeError, match=r"^it holds no points: give the scan$"):
        rerun(skeleton)
    assert len(rerun(skeleton, POINTS).vertices) == len(skeleton.vertices)


@pytest.mark.parametrize("recipe", [5, [], "x", {"pipeline": {}}])
def test_a_report_with_a_malformed_recipe(recipe):
    with pytest.raises(ValueError, match="recipe"):
        Report.from_dict({"recipe": recipe})


def test_reports_ahead_add_up():
    ahead = with_stage(Report(), RingBuilder(), 1.0)
    report = after(with_stage(with_stage(Report(n_input=3), RingBuilder(k=9), 0.5), Refiner(), 0.25), ahead)
    assert report.stages == tuple(map(repr, (RingBuilder(), RingBuilder(k=9), Refiner())))
    assert report.seconds == {"RingBuilder": 1.5, "Refiner": 0.25}
    assert report.recipe == recipe_of(*(stage.table() for stage in (RingBuilder(), RingBuilder(k=9), Refiner())))
    assert report.n_input == 3
