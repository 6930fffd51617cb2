"""In a MeshSet and in scripts percentages are MeshLab's: of the diagonal of the layer's bounding box."""

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d.errors import GlskError, InvalidCloudError, InvalidParameterError
from glsk_o3d.meshlab.layers import Layer
from glsk_o3d.meshlab.script import Call, Param, read_script, write_script
from glsk_o3d.meshlab.steps import PlainLayers, read_steps, step
from glsk_o3d.meshlab.verbs import verbs
from glsk_o3d.samples import sample_object

pymeshlab = pytest.importorskip("pymeshlab")

POINTS = sample_object(1200).points
LARGER = 1.7 * POINTS @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]


@pytest.fixture
def meshes():
    meshes = glsk.MeshSet()
    meshes.add_points(POINTS)
    meshes.add_points(LARGER)
    return meshes


def _made(meshes, name, **params):
    meshes.apply_filter(name, **params)
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix().copy(), mesh.edge_matrix().copy(), mesh.vertex_scalar_array().copy()


def _equal(a, b):
    return all(map(np.array_equal, a, b))


@pytest.mark.parametrize(
    ("name", "parameter"),
    [
        ("generate_curve_skeleton_glsk", "connector_radius"),
        ("generate_curve_skeleton_glsk", "ringbuilder_radius"),
        ("generate_one_rings_glsk", "radius"),
        ("generate_skeleton_graph_glsk", "radius"),
    ],
)
@pytest.mark.parametrize("layer", [0, 1])
def test_a_percentage_is_of_the_box_of_the_layer(meshes, name, parameter, layer):
    long = meshes.mesh(layer).bounding_box().diagonal() * 0.05
    given = [
        _made(meshes, name, **{parameter: value}, layer=layer)
        for value in (long, "5%", pymeshlab.PercentageValue(5), "5% of the frame")
    ]
    assert _equal(given[0], given[1])
    assert _equal(given[0], given[2])
    assert name == "generate_one_rings_glsk" or not _equal(given[0], given[3])


def test_it_is_that_of_meshlabs_filters_beside_it(meshes, tmp_path):
    meshes.generate_simplified_point_cloud(radius=pymeshlab.PercentageValue(5))
    meshes.save_filter_script(tmp_path / "s.mlx")
    (theirs,) = (float(p.attributes["value"]) for p in read_script(tmp_path / "s.mlx")[0].params if p.name == "Radius")
    verb = verbs()["generate_skeleton_graph_glsk"]
    (connector,) = verb.plan_for(meshes.layer(1), {"radius": "5%"}).stages
    assert connector.radius == pytest.approx(theirs, rel=1e-6)  # theirs is float32


def test_of_a_contracted_layer_it_is_the_layers_own(meshes):
    meshes.generate_contracted_cloud_glsk()
    layer, box = meshes.current_mesh_id(), meshes.current_mesh().bounding_box().diagonal()
    assert box < 0.97 * meshes.mesh(1).bounding_box().diagonal()
    name = "generate_skeleton_graph_glsk"
    assert _equal(_made(meshes, name, radius="5%", layer=layer), _made(meshes, name, radius=0.05 * box, layer=layer))


def test_a_layer_is_as_its_matrix_shows_it(meshes):
    meshes.set_matrix(transformmatrix=np.diag([2.0, 2, 2, 1]), freeze=False)
    (connector,) = verbs()["generate_skeleton_graph_glsk"].plan_for(meshes.layer(), {"radius": "5%"}).stages
    assert connector.radius == pytest.approx(0.1 * np.linalg.norm(np.ptp(LARGER, axis=0)))


def test_what_is_listed_can_be_given(meshes):
    for name in ("generate_curve_skeleton_glsk", "generate_skeleton_graph_glsk"):
        listed = meshes.filter_parameter_values(name)
        assert "1% of the frame" in listed.values()
        assert _equal(_made(meshes, name, layer=1), _made(meshes, name, **{**listed, "layer": 1}))
    given = meshes.filter_parameter_values("generate_skeleton_graph_glsk", radius=pymeshlab.PercentageValue(3))
    assert given["radius"] == "3.0%"


def test_scripts_keep_percentages(meshes, tmp_path):
    meshes.generate_curve_skeleton_glsk(ringbuilder_radius="20%", layer=1)
    meshes.save_filter_script(tmp_path / "s.mlx")
    text = (tmp_path / "s.mlx").read_text()
    assert '<Param type="RichAbsPerc" name="ringbuilder_radius" value="20%"/>' in text
    assert '<Param type="RichString" name="connector_radius" value="1% of the frame"/>' in text
    (again,) = read_steps(tmp_path / "s.mlx")
    large = PlainLayers(Layer.of(POINTS))
    large.layers.append(Layer.of(4096 * LARGER))  # a power of 2: every step is the same but for the exponents
    large.apply_step(again)
    np.testing.assert_allclose(
        large.layer().vertices, 4096 * meshes.current_mesh().vertex_matrix(), rtol=1e-9, atol=1e-9
    )


def test_points_that_are_dropped_have_no_part_in_the_box(meshes):
    name, extra = "generate_curve_skeleton_glsk", [[np.nan, 1e6, 0], [0, np.inf, 0]]
    given = {"connector_radius": "5%", "ringbuilder_drop_invalid": True}
    dirty = verbs()[name].run(Layer.of(np.concatenate([LARGER, extra])), given)
    assert _equal((dirty.vertices, dirty.edges, dirty.scalars), _made(meshes, name, connector_radius="5%"))


@pytest.mark.parametrize("cloud", [np.empty((0, 3)), np.ones((50, 3)), np.full((50, 3), np.nan)])
def test_a_cloud_without_extent_is_refused_for_that(cloud):
    verb = verbs()["generate_curve_skeleton_glsk"]
    said = []
    for given in ({}, {"connector_radius": "5%"}):
        with pytest.raises(InvalidCloudError) as caught:
            verb.run(Layer.of(cloud), given)
        said.append(str(caught.value))
    assert said[0] == said[1]


def test_coordinates_near_the_end_of_float64():
    assert Layer.of(1e200 * POINTS).diagonal == pytest.approx(1e200 * Layer.of(POINTS).diagonal)


@pytest.mark.parametrize("value", ["5 of the frame", "of the frame", "0% of the frame", "5% of the Frame", "5% of it"])
def test_other_words_are_refused(meshes, tmp_path, value):
    with pytest.raises(InvalidParameterError, match=f"^radius = '{value}': .*percentage"):
        meshes.generate_skeleton_graph_glsk(radius=value)
    param = Param("radius", "RichString", {"value": value})
    write_script(tmp_path / "s.mlx", [Call("Generate Skeleton Graph (GLSkeleton)", (param,))])
    with pytest.raises(GlskError, match=r"parameter 'radius': .*percentage"):
        read_steps(tmp_path / "s.mlx")


def test_percentages_are_checked_before_anything_runs():
    verb = verbs()["generate_skeleton_graph_glsk"]
    for value in ("101%", "0%", "-1%"):
        with pytest.raises(InvalidParameterError, match=f"^radius = '{value}': "):
            step(verb, {"radius": value})
