"""Parameters: checked when made, documented, and rebuilt by their own expressions; lengths."""

import dataclasses
import math
from fractions import Fraction

import pytest

import glsk_o3d as glsk
from glsk_o3d import (
    Connector,
    Contractor,
    ExplainedScore,
    InvalidParameterError,
    LPRReducer,
    Refiner,
    RingBuilder,
    RingSizeRatio,
    Tracer,
    samples,
)

FILTERS = (RingBuilder, Contractor, LPRReducer, Connector, Refiner)
DESCRIBED = (*FILTERS, ExplainedScore, RingSizeRatio)
PUBLIC = {name: getattr(glsk, name) for name in glsk.__all__}
POINTS = samples.torus(n=200).points


def fields():
    return [(cls, field) for cls in DESCRIBED for field in dataclasses.fields(cls)]


def wrong_values():
    """Every parameter with values outside of what its own description allows."""
    for cls, field in fields():
        facts = field.metadata
        kind, optional = facts["type"].rstrip("?"), facts["type"].endswith("?")
        wrong = [object(), "nonsense", [1], b"2%"]
        if not optional:
            wrong.append(None)
        if kind != "bool":
            wrong += [True] if kind != "choice" else []
        if kind in ("int", "float", "length"):
            wrong += [math.nan, math.inf, -math.inf, -1, 1j]
            if facts["low"] is not None:
                wrong.append(facts["low"] - 1)
                wrong += [facts["low"]] if facts["open_low"] else []
            if facts["high"] is not None:
                wrong.append(facts["high"] + 1)
        if kind == "int":
            wrong += [7.5, "7"]
        if kind == "length":
            wrong += ["0%", "-1%", "101%", "2", "%", "2%%", "nan%", ""]
        if kind in ("bool", "choice", "reducer", "stop"):
            wrong += [1, 0, "yes", ExplainedScore, LPRReducer]  # a class is no instance
        for value in wrong:
            yield pytest.param(cls, field.name, value, id=f"{cls.__name__}.{field.name}-{value!r:.20}")


@pytest.mark.parametrize(("cls", "name", "value"), list(wrong_values()))
def test_a_wrong_parameter_is_named(cls, name, value):
    with pytest.raises(InvalidParameterError, match=rf"^{cls.__name__}\.{name}"):
        cls(**{name: value})
    if cls in FILTERS:
        with pytest.raises(TypeError):
            cls(value)


@pytest.mark.parametrize("word", ["published ", "Auto", "16", ""])
def test_a_parameter_of_any_type_takes_its_words_and_no_others(word):
    with pytest.raises(InvalidParameterError, match=r"'auto'.*'published'"):
        RingBuilder(k=word)
    RingBuilder(k="auto")


@pytest.mark.parametrize(("cls", "field"), fields(), ids=lambda x: getattr(x, "__name__", None) or x.name)
def test_right_parameters_are_taken(cls, field):
    facts = field.metadata
    right = [field.default, *facts["choices"]]
    if facts["high"] is not None:
        right.append(facts["high"])
    if facts["low"] is not None and not facts["open_low"]:
        right.append(facts["low"])
    if facts["type"] == "length":
        right += ["2%", " 0.5 %", "100%", "1e-3%", 0.3, 7]
    if facts["type"] == "float":
        right.append(max(1, facts["low"] or 0))
    for value in right:
        cls(**{field.name: value})


def test_parameters_of_a_part_are_checked_too():
    with pytest.raises(InvalidParameterError, match=r"^ExplainedScore\.threshold"):
        Contractor(stop=ExplainedScore(-1))(POINTS)
    with pytest.raises(InvalidParameterError, match=r"^LPRReducer\.phi"):
        (RingBuilder() | Contractor(reducer=LPRReducer(phi=0)))(POINTS)


@pytest.mark.parametrize("cls", DESCRIBED)
def test_filters_are_frozen_hashable_and_documented(cls):
    one = cls()
    assert one == cls()
    assert hash(one) == hash(cls())
    for field in dataclasses.fields(cls):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(one, field.name, 1)
        assert f"\n{field.name} : " in cls.__doc__
        assert field.metadata["doc"] in cls.__doc__
        assert field.metadata["doc"].endswith(".")
        assert (field.metadata["unit"] or "-") != "-" or not field.metadata["type"].startswith("length")
        assert repr(field.default) in cls.__doc__


@pytest.mark.parametrize(
    ("cls", "options", "message"),
    [
        (RingBuilder, dict(radius=1e308), r"^RingBuilder\.radius"),
        (Connector, dict(radius=1e-320), r"^Connector\.radius"),
        (Connector, dict(radius="5e-324%"), "percentage"),
        (Connector, dict(thickness=Fraction(10**400)), r"^Connector\.thickness"),
        (Tracer, dict(root=10**400), r"^Tracer\.root"),
    ],
)
def test_numbers_out_of_range_are_refused(cls, options, message):
    with pytest.raises(InvalidParameterError, match=message):
        cls(**options)
