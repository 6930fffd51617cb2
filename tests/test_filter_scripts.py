"""The scripts in filters/ run at every scale, do what their table says, and are all documented."""

import re

import numpy as np
import pytest

import glsk_o3d
from glsk_o3d import samples
from glsk_o3d.apps.meshlab.script import comment
from glsk_o3d.apps.meshlab.steps import read_steps, scripts
from glsk_o3d.apps.meshlab.verbs import verbs

pymeshlab = pytest.importorskip("pymeshlab")


def _far_and_double(scale):
    tube = samples.SAMPLES["tube"](n=2000).points
    far = 2.0 * np.array([[1, 1, 0], [-1, 1, 0], [1, -1, 1], [-1, -1, 1], [0, 0, 2]])
    return scale * np.concatenate([tube, tube[:100], far]), far


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scan_cleanup_drops_copies_and_far_points(root, scale):
    points, far = _far_and_double(scale)
    scan = pymeshlab.MeshSet()
    scan.add_mesh(pymeshlab.Mesh(points))
    scan.load_filter_script(str(root / "filters" / "scan_cleanup.mlx"))
    scan.apply_filter_script()
    remaining = scan.current_mesh().vertex_matrix() / scale
    assert (np.linalg.norm(remaining[:, None] - far, axis=2) > 1e-3).all()
    assert 1900 < len(remaining) <= 2000
    assert len(np.unique(remaining, axis=0)) == len(remaining)

    ours = glsk_o3d.MeshSet()
    ours.add_points(points)
    ours.load_filter_script(root / "filters" / "scan_cleanup.mlx")
    ours.apply_filter_script()
    np.testing.assert_array_equal(ours.current_mesh().vertex_matrix() / scale, remaining)


@pytest.mark.parametrize("name", sorted(set(scripts()) - {"scan_cleanup"}))
def test_scripts_of_our_filters_fit_every_scale(name):
    results = []
    for scale in (1.0, 2.0**-10):
        meshes = glsk_o3d.MeshSet()
        meshes.add_points(scale * samples.torus(1000).points)
        meshes.load_filter_script(scripts()[name])
        meshes.apply_filter_script()
        layers = (meshes.layer(number) for number in range(meshes.mesh_number()))
        skeleton = next(layer for layer in layers if layer.is_skeleton).to_skeleton()
        results.append((skeleton.n_components, skeleton.n_loops, skeleton.length / scale))
    assert results[0][:2] == (1, 1)
    assert results[1] == pytest.approx(results[0], rel=1e-3)


@pytest.mark.parametrize("name", scripts())
def test_every_script_has_a_comment_and_is_documented(root, name):
    assert len(comment(scripts()[name])) > 40
    assert f"`{name}.mlx`" in (root / "filters" / "README.md").read_text()
    assert f"\n### {name}\n" in (root / "docs" / "meshlab.md").read_text()


def test_the_page_of_meshlab_has_a_script_and_all_filters(root, tmp_path):
    page = (root / "docs" / "meshlab.md").read_text()
    (script,) = re.findall(r"```xml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "page.mlx").write_text(script)
    assert read_steps(tmp_path / "page.mlx")[1].values == {"connector_radius": "2%"}
    table = re.findall(r"^\| `(\w+_glsk)` \| `([\w ]+)` \|", page, re.MULTILINE)
    assert {name: f"{title} (GLSkeleton)" for name, title in table} == {v.name: v.title for v in verbs().values()}
