"""What `glsk run` runs, refuses and says."""

import json

import numpy as np
import open3d as o3d
import pytest

import glsk_o3d
from glsk_o3d import read_cloud, read_skeleton
from glsk_o3d.apps.meshlab.layers import Layer

pytest.importorskip("pymeshlab")
OURS = '<FilterScript>\n<filter name="{}">\n{}\n</filter>\n</FilterScript>\n'


@pytest.fixture
def script(tmp_path):
    """Write a script of one filter."""

    def write(name, *params):
        (tmp_path / "s.mlx").write_text(OURS.format(name, "\n".join(params)))
        return "s.mlx"

    return write


@pytest.mark.filterwarnings("ignore:uncertain topology:glsk_o3d.SkeletonWarning")
def test_a_script_of_ours_is_the_pipeline(invoke, scans, script, tmp_path):
    scan = scans / "sample.ply"
    radius = '<Param type="RichAbsPerc" name="connector_radius" value="2%"/>'
    result = invoke("run", script("Generate Curve Skeleton (GLSkeleton)", radius), scan, "-o", "s.json", "-o", "s.ply")
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("1. Generate Curve Skeleton (GLSkeleton): layer 1, vertices ")
    assert result.stdout.endswith("wrote s.json\nwrote s.ply\n")
    radius = 0.02 * Layer.read(scan).diagonal
    expected = glsk_o3d.pipelines.default().with_options({"Connector.radius": radius})(read_cloud(scan))
    assert f", iterations {len(expected.report.iterations)}, " in result.stdout
    back = read_skeleton(tmp_path / "s.json")
    np.testing.assert_array_equal(back.vertices, expected.vertices)
    assert back.report.stages == expected.report.stages
    np.testing.assert_array_equal(read_skeleton(tmp_path / "s.ply").edges, expected.edges)


def test_the_cross_check_gives_its_verdict_and_writes_nothing(invoke, scans, tmp_path):
    result = invoke("run", "mesh_crosscheck", scans / "ring.ply", "--json")
    assert result.exit_code == 0, result.stderr
    created, checked = (step["result"] for step in json.loads(result.stdout)["steps"])
    assert created["loops"] == 1
    assert (checked["verdict"], checked["because"]) == ("agrees", [])
    assert checked["probability"] > 0.9
    assert not list(tmp_path.iterdir())


def test_points_are_written_with_labels_and_colours(invoke, scans, script, tmp_path):
    outputs = [word for ending in ("ply", "xyz") for word in ("-o", f"c.{ending}")]
    result = invoke("run", script("Generate Segmented Cloud (GLSkeleton)"), scans / "sample.ply", *outputs, "-q")
    assert result.exit_code == 0, result.stderr
    points = np.asarray(read_cloud(scans / "sample.ply").points)
    for name in ("c.ply", "c.xyz"):
        np.testing.assert_allclose(np.asarray(read_cloud(tmp_path / name).points), points, rtol=1e-15)
    cloud = o3d.t.io.read_point_cloud(str(tmp_path / "c.ply"))
    labels, colours = cloud.point.quality.numpy().ravel(), cloud.point.colors.numpy()
    assert len(np.unique(labels)) == len(np.unique(np.column_stack([labels, colours]), axis=0)) > 1


def test_what_meshlab_cannot_do(refused, script, tmp_path, scans, y):
    (tmp_path / "torn.ply").write_bytes((scans / "sample.ply").read_bytes()[:2000])
    wrong_layer = script("Hausdorff Distance", '<Param type="RichInt" name="SampledMesh" value="9"/>')
    for words, message in (
        ("scan_cleanup torn.ply -o c.ply", "torn.ply: not a valid .ply file: it promises 1100 points"),
        ("scan_cleanup a.zzz -o c.ply", "a.zzz: "),
        (f"{wrong_layer} {scans}/sample.ply", "s.mlx, line 2: filter 'Hausdorff Distance': sampledmesh = 9: "),
    ):
        assert message in refused(1, "run", *words.split())


def test_points_that_are_not_finite_and_loops(invoke, refused, scans, script, tmp_path):
    name, parameter = "Generate Curve Skeleton (GLSkeleton)", "sampler_drop_invalid"
    line = refused(1, "run", script(name), scans / "nan.ply", "-o", "s.ply")
    assert f"the first at index 3: drop them with the parameter {parameter}, or remove them first" in line
    cured = script(name, f'<Param type="RichBool" name="{parameter}" value="true"/>')
    assert "NaN" not in invoke("run", cured, scans / "nan.ply", "-o", "s.ply").stderr
    assert invoke("run", script(name), scans / "ring.ply", "-o", "1.swc").exit_code == 1
    assert invoke("run", "glskeleton", scans / "ring.ply", "-o", "1.swc", "--cut-loops").exit_code == 0
    assert read_skeleton(tmp_path / "1.swc").n_loops == 0
