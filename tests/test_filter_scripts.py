"""The MeshLab scripts in filters/ run, and do what their table says."""

import numpy as np
import pytest

from glsk_o3d import samples

pymeshlab = pytest.importorskip("pymeshlab")


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_scan_cleanup(root, scale):
    tube = samples.SAMPLES["tube"](n=2000).points
    far = 2.0 * np.array([[1, 1, 0], [-1, 1, 0], [1, -1, 1], [-1, -1, 1], [0, 0, 2]])
    scan = pymeshlab.MeshSet()
    scan.add_mesh(pymeshlab.Mesh(scale * np.concatenate([tube, tube[:100], far])))
    scan.load_filter_script(str(root / "filters" / "scan_cleanup.mlx"))
    scan.apply_filter_script()
    left = scan.current_mesh().vertex_matrix() / scale
    assert (np.linalg.norm(left[:, None] - far, axis=2) > 1e-3).all()
    assert 1900 < len(left) <= 2000
    assert len(np.unique(left, axis=0)) == len(left)
