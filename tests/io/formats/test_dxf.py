import numpy as np
import pytest


def test_ezdxf_reads_a_polyline_per_branch(skeleton, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    skeleton.save(tmp_path / "s.dxf")
    drawing = ezdxf.readfile(tmp_path / "s.dxf")
    assert not drawing.audit().errors
    assert drawing.dxfversion == "AC1009"
    lines = [entity for entity in drawing.modelspace() if entity.dxftype() == "POLYLINE"]
    points = [entity for entity in drawing.modelspace() if entity.dxftype() == "POINT"]
    assert len(lines) == len(skeleton.branches)
    for line, path in zip(lines, skeleton.branches, strict=True):
        assert line.is_3d_polyline
        curve = skeleton.vertices[path]
        closed = len(path) > 2 and path[0] == path[-1]
        assert line.is_closed == closed
        np.testing.assert_array_equal([tuple(place) for place in line.points()], curve[: len(curve) - closed])
    alone = skeleton.vertices[skeleton.degree == 0]
    np.testing.assert_array_equal(np.reshape([tuple(point.dxf.location) for point in points], (-1, 3)), alone)
