"""Report and IterationRecord."""

import dataclasses
import json

import numpy as np
import pytest

from glsk_o3d import Contractor, Report, RingBuilder, SkeletonWarning, samples
from glsk_o3d.pipeline import with_stage


@pytest.fixture(scope="module")
def report():
    return (RingBuilder() | Contractor(max_iterations=2))(samples.torus(n=300).points).report


def test_survives_json(report):
    again = Report.from_dict(json.loads(json.dumps(report.to_dict())))
    assert again == report
    assert isinstance(again.iterations, tuple)
    assert again.iterations[1].iteration == 2
    assert Report.from_dict({}) == Report()


def test_dict_holds_plain_python_values_only(report):
    def plain(value):
        if isinstance(value, dict):
            return all(isinstance(key, str) and plain(item) for key, item in value.items())
        if isinstance(value, (list, tuple)):
            return all(map(plain, value))
        return type(value) in (int, float, bool, str)

    assert plain(report.to_dict())


def test_is_frozen(report):
    for part in (report, report.iterations[0]):
        with pytest.raises(dataclasses.FrozenInstanceError):
            part.converged = True


def test_stages_add_up():
    empty = Report()
    once = with_stage(empty, RingBuilder(k=9), 0.5)
    twice = with_stage(with_stage(once, Contractor(), 0.25), RingBuilder(), 0.125)
    assert twice.stages == (repr(RingBuilder(k=9)), repr(Contractor()), repr(RingBuilder()))
    assert twice.seconds == {"RingBuilder": 0.625, "Contractor": 0.25}
    assert empty == Report()
    assert once.stages == (repr(RingBuilder(k=9)),)


def test_warnings_are_issued_and_kept():
    with pytest.warns(SkeletonWarning, match="first"):
        report = Report().with_warning("first")
    with pytest.warns(SkeletonWarning, match="second"):
        report = report.with_warning("second")
    assert report.warnings == ("first", "second")


def test_names_the_versions():
    versions = Report().versions
    assert versions["numpy"] == np.__version__
    assert set(versions) >= {"glsk-o3d", "numpy", "scipy", "open3d"}
