"""`--set Filter.parameter=value`: parsing, placing, refusing."""

from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Contractor, InvalidParameterError, LPRReducer, Pipeline, RingBuilder, RingSizeRatio
from glsk_o3d.cli.overrides import override
from glsk_o3d.pipeline import parts
from glsk_o3d.pipelines import default


def find(pipeline, name):
    (actual,) = [part for part in parts(pipeline) if type(part).__name__ == name]
    return actual


@pytest.mark.parametrize(
    ("setting", "name", "value"),
    [
        ("RingBuilder.k=16", "k", 16),
        ("Refiner.limb=0", "limb", 0.0),
        (" RingBuilder . k = auto ", "k", "auto"),
        ("RingBuilder.radius=none", "radius", None),
        ("Connector.radius=2.5%", "radius", "2.5%"),
        ("Connector.radius=1e-3", "radius", 1e-3),
        ("LPRReducer.phi=1e4", "phi", 1e4),
        ("LPRReducer.order=index", "order", "index"),
        ("LPRReducer.conserve_mass=no", "conserve_mass", False),
        ("Sampler.drop_invalid=ON", "drop_invalid", True),
        ("Tracer.root=0.5,0,-2e3", "root", "0.5,0,-2e3"),
        ("Contractor.stop=RingSizeRatio", "stop", RingSizeRatio()),
        ("Contractor.reducer=none", "reducer", None),
    ],
)
def test_values_of_every_kind(setting, name, value):
    owner = setting.partition(".")[0].strip()
    changed = override(default(), [setting])
    got = getattr(find(changed, owner), name)
    assert (got, type(got)) == (value, type(value))
    before = getattr(find(default(), owner), name)
    assert changed.with_options({f"{owner}.{name}": before}) == default()  # nothing else has changed


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
        ("Contractor.stop=RingSizeRati", "no stop is called 'RingSizeRati': did you mean 'RingSizeRatio'?"),
        ("Contractor.stop=LPRReducer", "no stop is called 'LPRReducer'"),
        ("Contractor.reducer=Contractor", "no reducer is called 'Contractor'"),
        ("RingBuilder.k=many", "RingBuilder.k = 'many': must be an int, or 'auto', or 'published'"),
        ("LPRReducer.phi=nan", "LPRReducer.phi = nan: must be finite"),
        ("LPRReducer.conserve_mass=maybe", "LPRReducer.conserve_mass = 'maybe': must be True or False"),
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
