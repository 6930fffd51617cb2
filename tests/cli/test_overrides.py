"""`--set Filter.parameter=value`: parsing, placing, refusing."""

import dataclasses
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import glsk_o3d
from glsk_o3d import Contractor, InvalidParameterError, LPRReducer, Pipeline, RingBuilder, RingSizeRatio
from glsk_o3d.cli.overrides import override
from glsk_o3d.parameters import SMALLEST_LENGTH
from glsk_o3d.pipeline import parts
from glsk_o3d.pipelines import PIPELINES, cao2010, default
from glsk_o3d.recipes.catalogue import catalogue

RULES = {"stop": ["ExplainedScore", "RingSizeRatio"], "reducer": ["LPRReducer"]}
FIELDS = [(cls, field) for cls in catalogue().values() for field in dataclasses.fields(cls)]


def find(pipeline, name):
    (found,) = [part for part in parts(pipeline) if type(part).__name__ == name]
    return found


def values(facts):
    """Texts a user may write for a parameter, each with what it means."""
    kind = facts["type"].rstrip("?")
    low = facts["low"] if facts["low"] is not None else 0
    high = facts["high"] if facts["high"] is not None else low + 1e6
    if kind == "int":
        plain = st.integers(int(low) + 1, int(high)).map(lambda n: (str(n), n))
    elif kind == "float":
        plain = st.floats(low, high, exclude_min=True).flatmap(
            lambda x: st.sampled_from([(repr(x), x), (f"{x:.17e}", x)])
        )
    elif kind == "length":
        percent = st.floats(0.001, 100).map(lambda x: (f"{x:.6f}%", f"{x:.6f}%"))
        plain = percent | st.floats(max(low, SMALLEST_LENGTH), high).map(lambda x: (repr(x), x))
    elif kind == "point":
        plain = st.just(("0.5,0,-2e3", "0.5,0,-2e3"))
    elif kind == "bool":
        plain = st.sampled_from([("true", True), ("no", False), ("1", True), ("OFF", False)])
    elif kind != "choice":
        plain = st.sampled_from([(name, catalogue()[name]()) for name in RULES[kind]])
    if facts["choices"]:  # any type may also be a word
        words = st.sampled_from([(choice, choice) for choice in facts["choices"]])
        plain = words if kind == "choice" else plain | words
    return plain | st.sampled_from([("none", None), ("None", None)]) if facts["type"].endswith("?") else plain


@pytest.mark.parametrize(("cls", "field"), FIELDS, ids=[f"{cls.__name__}.{field.name}" for cls, field in FIELDS])
@settings(max_examples=20)
@given(data=st.data())
def test_every_parameter_can_be_set(cls, field, data):
    text, value = data.draw(values(field.metadata))
    start = default() if cls is not RingSizeRatio else cao2010()
    changed = override(start, [f" {cls.__name__}.{field.name} = {text}"])
    got = getattr(find(changed, cls.__name__), field.name)
    assert got == value
    assert type(got) is type(value)
    before = getattr(find(start, cls.__name__), field.name)
    assert changed.with_options({f"{cls.__name__}.{field.name}": before}) == start  # nothing else has changed


def test_round_trip_of_every_pipeline():
    for make in PIPELINES.values():
        pipeline = make()
        settings = [
            f"{type(part).__name__}.{f.name}={value}"
            for part in parts(pipeline)
            for f in dataclasses.fields(part)
            if dataclasses.is_dataclass(value := getattr(part, f.name)) is False
        ]
        start = default() if find(pipeline, "Contractor").reducer else cao2010()
        kinds = {type(stage) for stage in pipeline.stages}
        start = Pipeline(*(stage for stage in start.stages if type(stage) in kinds))
        assert override(start, settings) == pipeline
        names = vars(glsk_o3d) | {name: getattr(glsk_o3d, name) for name in catalogue()}
        assert eval(repr(pipeline), names) == pipeline


def test_where_settings_go():
    before = default()
    after = override(before, ["LPRReducer.phi=1e4", "ExplainedScore.threshold=0.01"])  # inside another filter
    assert find(after, "Contractor").reducer.phi == 1e4
    assert find(after, "Contractor").stop.threshold == 0.01
    assert before == default()
    assert find(override(before, ["RingBuilder.k=9", "RingBuilder.k=10"]), "RingBuilder").k == 10
    assert override(before, ["k=24", "reducer=none"]) == before.with_options(k=24, reducer=None)
    settings = ["stop=RingSizeRatio", "threshold=0.6"]  # in their order
    assert find(override(before, settings), "Contractor").stop == RingSizeRatio(threshold=0.6)
    twice = Pipeline(RingBuilder(), Contractor(reducer=LPRReducer()), LPRReducer())
    changed = override(twice, ["LPRReducer.phi=7"])
    assert [part.phi for part in parts(changed) if isinstance(part, LPRReducer)] == [7, 7]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        *(
            (word, "write it as Filter.parameter=value")
            for word in ("", "Connector.radius", "Connector.=2%", ".radius=2%")
        ),
        ("radius=2%", "--set radius=2%: radius: more than one part of the pipeline has it"),
        ("max_iteration=2", "did you mean 'max_iterations'?"),
        ("connector.radius=2%", "connector is not in the pipeline, which has Sampler, OutlierRemover, "),
        ("RingBuilder.consumes=cloud", "no parameter of RingBuilder is called 'consumes'"),
        ("Contractor.stop=RingSizeRati", "no stop is called 'RingSizeRati': did you mean 'RingSizeRatio'?"),
        ("Contractor.stop=LPRReducer", "no stop is called 'LPRReducer'"),
        ("Contractor.reducer=Contractor", "no reducer is called 'Contractor'"),
        ("Contractor.stop=none", "no stop is called 'none'"),
        ("RingBuilder.k=many", "RingBuilder.k = 'many': must be an int, or 'auto', or 'published'"),
        ("LPRReducer.phi=nan", "LPRReducer.phi = nan: must be finite"),
        ("LPRReducer.conserve_mass=maybe", "LPRReducer.conserve_mass = 'maybe': must be True or False"),
        ("Connector.radius=101%", "a percentage of the diagonal lies above 0% and up to 100%"),
    ],
)
def test_refuses(setting, message):
    with pytest.raises(InvalidParameterError) as caught:
        override(default(), [setting])
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@settings(max_examples=50)
@given(st.text() | st.from_regex(r"[A-Z][a-z]+\.[a-z]+=.*", fullmatch=True))
def test_any_text_is_a_setting_or_refused(text):
    with suppress(InvalidParameterError):
        override(default(), [text])
