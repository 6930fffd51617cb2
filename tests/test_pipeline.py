"""Filters, pipelines of them, the named ones, other options, and what skeletonize promises."""

import dataclasses
import operator
from functools import reduce

import numpy as np
import pytest
from scipy.spatial import cKDTree

import glsk_o3d as glsk
from glsk_o3d import (
    Cloud,
    Connector,
    Contraction,
    Contractor,
    Denoiser,
    InvalidParameterError,
    LPRReducer,
    OutlierRemover,
    Pipeline,
    Points,
    Refiner,
    RingBuilder,
    RingSizeRatio,
    Sampler,
    Skeleton,
    StageError,
    Thinner,
    pipelines,
    samples,
    skeletonize,
)
from glsk_o3d.analysis import compare

FILTERS = (Sampler, OutlierRemover, Denoiser, Thinner, RingBuilder, Contractor, LPRReducer, Connector, Refiner)
NAMES = tuple(pipelines.PIPELINES)
PUBLIC = {name: getattr(glsk, name) for name in glsk.__all__}
POINTS = samples.y_junction(n=500).points


def assert_same_arrays(a, b):
    for field in dataclasses.fields(a):
        x, y = getattr(a, field.name), getattr(b, field.name)
        if isinstance(x, np.ndarray):
            np.testing.assert_array_equal(x, y, err_msg=field.name)


def assert_same(a, b):
    assert_same_arrays(a, b)
    for name in ("stages", "converged", "stop_reason", "warnings", "n_distinct"):
        assert getattr(a.report, name) == getattr(b.report, name)


@pytest.fixture(scope="module")
def flow():
    """What comes out of every stage, by its class."""
    points = samples.torus(n=200).points
    contracted = Contractor(max_iterations=1)(RingBuilder()(points))
    return {Cloud: points, Points: Sampler()(points), Contraction: contracted, Skeleton: Connector()(contracted)}


@pytest.mark.parametrize(
    ("cls", "given"),
    [
        (cls, kind)
        for cls in FILTERS
        for kind in (Cloud, Points, Contraction, Skeleton)
        if not (cls.consumes is kind or (kind is Cloud and cls.takes_clouds()))
    ],
)
def test_a_filter_refuses_what_another_one_takes(cls, given, flow):
    with pytest.raises(StageError, match=cls.__name__):
        cls()(flow[given])


@pytest.mark.parametrize("name", NAMES)
def test_a_pipeline_is_its_filters_called_in_turn(name):
    pipeline = pipelines.PIPELINES[name]()
    by_hand = POINTS
    for stage in pipeline.stages:
        by_hand = stage(by_hand)
    assert_same(pipeline(POINTS), by_hand)
    assert_same(skeletonize(POINTS.copy(), name), by_hand)  # the same to the last bit
    records = []
    skeleton = skeletonize(POINTS, pipeline, on_iteration=records.append)
    assert_same(skeleton, by_hand)
    assert tuple(records) == skeleton.report.iterations
    if name == "default":
        assert_same(skeletonize(POINTS), by_hand)
    report = by_hand.report
    assert eval(" | ".join(report.stages), PUBLIC) == pipeline  # as its documentation says
    assert set(report.seconds) >= {type(stage).__name__ for stage in pipeline.stages}


def test_bars_between_filters_associate():
    a, b, c, d = RingBuilder(), Contractor(), Connector(), Refiner()
    pipeline = a | b | c | d
    assert isinstance(pipeline, Pipeline)
    assert pipeline.stages == (a, b, c, d)
    assert (a | b) | (c | d) == a | (b | (c | d)) == Pipeline(a, b, c, d) == pipeline
    assert hash((a | b) | (c | d)) == hash(pipeline)
    assert pipeline != a | b | c
    assert pipeline != "pipeline"


@pytest.mark.parametrize(
    "stages",
    [
        (RingBuilder(), Connector(), Contractor()),
        (RingBuilder(), Refiner()),
        (Contractor(), RingBuilder()),
        (Connector(), Connector()),
    ],
    ids=lambda stages: "-".join(type(stage).__name__ for stage in stages),
)
def test_stages_that_do_not_fit_are_refused_when_joined(stages):
    with pytest.raises(InvalidParameterError, match=r"RingBuilder \| Contractor"):
        Pipeline(*stages)
    with pytest.raises(InvalidParameterError):
        reduce(operator.or_, stages)


@pytest.mark.parametrize("thing", [3, "Connector", Connector, None, RingSizeRatio()])
def test_only_filters_can_be_joined_and_only_pipelines_run(thing):
    with pytest.raises(InvalidParameterError):
        RingBuilder() | thing
    with pytest.raises(InvalidParameterError):
        Pipeline(RingBuilder(), thing)
    with pytest.raises((InvalidParameterError, StageError)):
        skeletonize(POINTS, thing)
    with pytest.raises(InvalidParameterError):
        Pipeline()


def test_options_by_full_and_by_short_name():
    *prepare, builder, contractor, connector, refiner, tracer = pipelines.default().stages
    varied = pipelines.default().with_options({"RingBuilder.k": 24, "phi": 2e5}, spacing=1)
    assert varied == (
        Pipeline(*prepare)
        | dataclasses.replace(builder, k=24)
        | dataclasses.replace(contractor, reducer=dataclasses.replace(contractor.reducer, phi=2e5))
        | connector
        | dataclasses.replace(refiner, spacing=1)
        | tracer
    )
    assert pipelines.default().with_options() == pipelines.default().with_options({}) == pipelines.default()


@pytest.mark.parametrize("order", [1, -1])
def test_options_of_a_part_may_be_set_with_the_part(order):
    options = [("RingSizeRatio.threshold", 0.5), ("stop", RingSizeRatio()), ("phi", 7.0), ("reducer", LPRReducer())]
    contractor = pipelines.cao2010().with_options(dict(options[::order])).stages[2]
    assert contractor.stop == RingSizeRatio(0.5)
    assert contractor.reducer == LPRReducer(phi=7.0)
    assert pipelines.default().with_options(reducer=None).stages[5].reducer is None
    for gone in ([("phi", 3), ("reducer", None)], [("threshold", 0.5), ("stop", max)]):  # options of nothing
        with pytest.raises(InvalidParameterError, match=gone[0][0]):
            pipelines.default().with_options(dict(gone[::order]))


@pytest.mark.parametrize(
    ("options", "named", "words"),
    [
        ({"spaceing": 3}, {}, "'spacing'"),  # did you mean
        ({"RingBuilder.spacing": 3}, {}, "no parameter of RingBuilder"),
        ({"Ringbuilder.k": 3}, {}, "which has Sampler, "),
        ({"radius": 3}, {}, "'RingBuilder.radius' or 'Connector.radius'"),
        ({1: 2}, {}, "1"),
        ({"RingBuilder.k": 24}, {"k": 12}, "RingBuilder.k and k"),
        ({"k": "twelve"}, {}, r"RingBuilder\.k"),
        ({}, {"stop": "never"}, r"Contractor\.stop"),
    ],
)
def test_unknown_wrong_and_doubled_options_are_refused(options, named, words):
    with pytest.raises(InvalidParameterError, match=words):
        pipelines.default().with_options(options, **named)
    with pytest.raises(InvalidParameterError, match=words):
        skeletonize(np.zeros((0, 3)), options, **named)


def test_unknown_and_incomplete_pipelines_are_refused():
    known = (("cao2011", "'cao2010'"), ("best", "wen2024, cao2010"), (RingBuilder() | Contractor(), "from a cloud"))
    for wrong, words in known:
        with pytest.raises(InvalidParameterError, match=words):
            skeletonize(POINTS, wrong)


@pytest.mark.parametrize(
    ("shape", "components", "loops", "leaves"),
    [("tube", 1, 0, 2), ("torus", 1, 1, 0), ("helix", 1, 0, 2), ("y_junction", 1, 0, 3), ("two_rings", 2, 2, 0)],
)
def test_the_default_finds_the_axis_of_known_shapes(shape, components, loops, leaves):
    sample = samples.SAMPLES[shape](n=2048)
    skeleton = skeletonize(sample.points)
    assert (skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)) == (components, loops, leaves)
    measures = compare(skeleton, sample)
    assert measures.error < 0.1
    assert measures.inside == measures.completeness == 1
    assert np.median(skeleton.radii) == pytest.approx(sample.radii.mean(), rel=0.1)


@pytest.mark.filterwarnings("ignore:uncertain topology")  # about the sauropod's handle
@pytest.mark.parametrize("n", [2000, 4096, 16384])
@pytest.mark.parametrize(
    ("shape", "components", "loops", "leaves"),
    [("torus", 1, 1, 0), ("y_junction", 1, 0, 3), ("sauropod", 1, 1, 6), ("two_rings", 2, 2, 0)],
)
def test_fast_gives_right_graphs_from_few_points(shape, n, components, loops, leaves):
    sample = samples.SAMPLES[shape](n=n)
    skeleton = skeletonize(sample.points, "fast")
    assert (skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)) == (components, loops, leaves)
    assert skeleton.report.n_sampled < 1000
    assert max(solve.n_points for solve in skeleton.report.iterations) < 1000
    assert len(skeleton.vertex_of_point) == n
    assert compare(skeleton, sample).error < 0.4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cao2010", "default"])
def test_a_skeleton_moves_and_scales_with_its_cloud(name):
    """Measured: vertices agree to 1e-7 tube radii, from roundings of 1e-16 that ill-conditioned late solves blow up."""
    shape = np.round(samples.y_junction(n=700).points * 2**20) / 2**20  # so that the shift costs them 1e-10
    still, turn = skeletonize(shape, name), np.eye(3)[[1, 2, 0]]
    for scale, shift, turned in ((1, 1e6, np.eye(3)), (1e-3, 0, np.eye(3)), (1e3, 0, turn)):
        moved = skeletonize(scale * shape @ turned + shift, name)
        np.testing.assert_array_equal(moved.edges, still.edges)
        np.testing.assert_array_equal(moved.vertex_of_point, still.vertex_of_point)
        np.testing.assert_allclose((moved.vertices - shift) @ turned.T / scale, still.vertices, atol=1e-6 * 0.1)
        np.testing.assert_allclose(moved.radii / scale, still.radii, rtol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tube", "torus", "y_junction", "two_rings"])
def test_a_skeleton_turns_with_its_cloud_in_any_order(name):
    """The same skeleton turned back, but for rounding.

    The published pipelines do not promise it: a turn changes the bounding box, and with it the weights.
    """
    rng = np.random.default_rng(0)
    points = samples.SAMPLES[name](n=1024).points
    turn, order = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.permutation(1024)
    still, turned = skeletonize(points), skeletonize(points[order] @ turn)
    size = 1e-6 * np.ptp(points, axis=0).max()
    assert len(turned.vertices) == len(still.vertices)
    distance, place = cKDTree(still.vertices).query(turned.vertices @ turn.T)
    assert distance.max() < size
    assert sorted(place) == list(range(len(still.vertices)))
    edges = np.sort(place[turned.edges], axis=1)
    np.testing.assert_array_equal(edges[np.lexsort(edges.T[::-1])], still.edges)
    np.testing.assert_array_equal(place[turned.vertex_of_point], still.vertex_of_point[order])
    np.testing.assert_allclose(turned.radii, still.radii[place], atol=size)
    np.testing.assert_allclose(turned.confidence, still.confidence[place], atol=1e-6)


@pytest.mark.parametrize("answer", [False, np.False_, 0])
def test_a_caller_may_stop_a_contraction(answer):
    stopped = skeletonize(POINTS, on_iteration=lambda record: answer if record.iteration == 2 else None)
    assert len(stopped.report.iterations) == 2
    assert stopped.report.stop_reason == "stopped by the caller"


def test_a_caller_that_changes_a_state_does_not_change_the_run():
    def spoil(state):
        for array in (state.positions, state.previous, state.cloud, state.points, state.mass, state.rings.indices):
            array[:] = 0
        state.report.versions.clear()

    assert_same(skeletonize(POINTS, on_state=spoil), skeletonize(POINTS))
