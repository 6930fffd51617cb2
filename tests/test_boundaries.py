"""Between two filters: whatever equals what one gave, a copy or a file, gives the same in the next."""

import pickle
from copy import deepcopy
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from glsk_o3d import Skeleton, pipelines, read_skeleton, samples, save_skeleton

pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
CLOUDS = {"small": samples.sauropod(1500).points, "sampled": samples.sauropod(12000, seed=1).points}


def assert_equal(one, other, name=""):
    """To the last bit, but for the seconds."""
    assert type(one) is type(other), name
    if is_dataclass(one):
        for field in fields(one):
            if field.name not in ("seconds", "versions"):
                assert_equal(getattr(one, field.name), getattr(other, field.name), f"{name}.{field.name}")
    elif isinstance(one, np.ndarray):
        np.testing.assert_array_equal(one, other, err_msg=name)
    elif isinstance(one, tuple):
        assert len(one) == len(other), name
        for each, its in zip(one, other, strict=True):
            assert_equal(each, its, name)
    else:
        np.testing.assert_equal(one, other, err_msg=name)


def copies(data, folder):
    """The same value, made in every way that there is, by name."""
    yield "deepcopy", deepcopy(data)
    yield "pickle", pickle.loads(pickle.dumps(data))
    if not isinstance(data, np.ndarray):
        yield "replace", replace(data)
        yield "with_report", data.with_report(replace(data.report))
    if isinstance(data, Skeleton):
        for ending in ("json", "npz"):
            save_skeleton(data, folder / f"between.{ending}")
            yield ending, read_skeleton(folder / f"between.{ending}")


@pytest.mark.parametrize("name", ["default", "tree"])
@pytest.mark.parametrize("cloud", CLOUDS)
def test_equal_values_give_equal_results(name, cloud, tmp_path):
    pipeline = pipelines.PIPELINES[name]()
    if cloud == "sampled":
        pipeline = pipeline.with_options(size=5000, thin_to=2500)
    data = CLOUDS[cloud]
    for stage in pipeline.stages:
        following, before = stage(data), deepcopy(data)
        for way, copied in copies(data, tmp_path):
            assert_equal(copied, data, way)
            assert_equal(stage(copied), following, f"{type(stage).__name__} after {way}")
        assert_equal(data, before, type(stage).__name__)
        data = following
    assert (data.report.n_sampled < len(data.points)) == (cloud == "sampled")
    whole = pipeline(CLOUDS[cloud])
    assert whole.report.stages[-1] == repr(pipeline.stages[-1]) == data.report.stages[-1]
    assert_equal(whole.with_report(data.report), data)
    for _, copied in copies(data, tmp_path):
        assert_equal(copied, data)


def test_a_raw_graph_keeps_in_a_file_who_represents_whom(tmp_path):
    raw = pipelines.rings().with_options(size=5000, thin_to=2500)(CLOUDS["sampled"])
    for stage in pipelines.default().stages[5:7]:
        raw = stage(raw)
    known = raw.representative_of_point
    assert 0 < (known == np.arange(12000)).sum() < (known >= 0).sum() < 12000
    others = known[(known >= 0) & (known != np.arange(12000))]
    assert np.isin(others, raw.supporting_points).all()
    for ending in ("json", "npz"):
        save_skeleton(raw, tmp_path / f"raw.{ending}")
        np.testing.assert_array_equal(read_skeleton(tmp_path / f"raw.{ending}").representative_of_point, known)
