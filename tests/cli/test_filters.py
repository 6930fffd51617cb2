"""`glsk filters` says everything that the code knows about itself."""

import dataclasses
import json

import pytest

from glsk_o3d.pipeline import Filter
from glsk_o3d.pipelines import PIPELINES
from glsk_o3d.recipes.catalogue import catalogue


@pytest.fixture
def squeezed(invoke, monkeypatch):
    """Output with all white space made one."""
    monkeypatch.setenv("COLUMNS", "80")
    return lambda *words: " ".join(invoke("filters", *words).stdout.split())


def test_the_catalogue_is_complete():
    assert list(catalogue()) == [
        *("RingBuilder", "Contractor", "LPRReducer", "Connector", "Refiner"),
        *("ExplainedScore", "RingSizeRatio"),
    ]


@pytest.mark.parametrize("name", list(catalogue()))
def test_every_parameter_is_listed(squeezed, name):
    whole, one = squeezed(), squeezed(name)
    for field in dataclasses.fields(catalogue()[name]):
        facts = field.metadata
        default = "none" if field.default is None else field.default
        for text in (whole, one):
            assert f"{field.name} {facts['doc']}" in text
            assert f"default {default}" in text
        for choice in facts["choices"]:
            assert choice in one
        if facts["unit"] != "-":
            assert f"[{facts['unit']}]" in one
        if facts["low"] is not None:
            assert f"{'above' if facts['open_low'] else 'at least'} {facts['low']:g}" in one
        if facts["high"] is not None:
            assert f"at most {facts['high']:g}" in one


def test_json_has_every_field(invoke):
    told = json.loads(invoke("filters", "--json").stdout)
    assert [each["name"] for each in told["filters"]] == list(catalogue())
    for each in told["filters"]:
        cls = catalogue()[each["name"]]
        assert each["kind"] == ("filter" if issubclass(cls, Filter) else "stopping rule")
        flows = ("cloud", "Contraction", "Skeleton") if issubclass(cls, Filter) else (None,)
        assert {each["consumes"], each["produces"]} <= set(flows)
        assert [p["name"] for p in each["parameters"]] == [f.name for f in dataclasses.fields(cls)]
        for parameter, field in zip(each["parameters"], dataclasses.fields(cls), strict=True):
            assert parameter["type"] == field.metadata["type"]
            plain = field.default if not dataclasses.is_dataclass(field.default) else repr(field.default)
            assert parameter["default"] == plain
    assert {each["name"]: each["expression"] for each in told["pipelines"]} == {
        n: repr(p()) for n, p in PIPELINES.items()
    }


@pytest.mark.parametrize("name", PIPELINES)
def test_pipelines_are_spelt_out(squeezed, name):
    for words in ([], [name]):
        assert repr(PIPELINES[name]()) in squeezed(*words)
    assert "RingSizeRatio stopping rule" not in squeezed(name)


def test_fits_eighty_columns(invoke, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert max(map(len, invoke("filters").stdout.splitlines())) <= 80


def test_a_name_that_is_not_there(refused):
    assert (
        refused(2, "filters", "Contracter")
        == "no filter or pipeline is called 'Contracter': did you mean 'Contractor'?"
    )
