"""Branches as polylines: CGAL's text, DXF in ezdxf, VTP in VTK."""

import numpy as np
import pytest


def test_polylines_have_a_line_per_branch(tree, forest, tmp_path):
    tree.save(tmp_path / "s.cgal")
    lines = (tmp_path / "s.cgal").read_text().splitlines()
    assert sorted(int(line.split()[0]) for line in lines) == [2, 3, 3]
    forest.save(tmp_path / "s.polylines.txt")
    lines = (tmp_path / "s.polylines.txt").read_text().splitlines()
    assert sorted(int(line.split()[0]) for line in lines) == [1, 2, 3]


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


def test_vtk_reads_vertices_branches_and_radii(skeleton, tmp_path):
    reader_module = pytest.importorskip("vtkmodules.vtkIOXML", reason="vtk is not installed")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    skeleton.save(tmp_path / "s.vtp")
    reader = reader_module.vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "s.vtp"))
    reader.Update()
    back = reader.GetOutput()
    np.testing.assert_array_equal(vtk_to_numpy(back.GetPoints().GetData()), skeleton.vertices)
    for name, values in (("radius", skeleton.radii), ("confidence", skeleton.confidence)):
        np.testing.assert_array_equal(vtk_to_numpy(back.GetPointData().GetArray(name)), values)
    cells = vtk_to_numpy(back.GetCellData().GetArray("branch"))
    alone = int((skeleton.degree == 0).sum())
    np.testing.assert_array_equal(cells, [*[-1] * alone, *range(len(skeleton.branches))])
    assert back.GetNumberOfVerts() == alone
    for i, path in enumerate(skeleton.branches):
        cell = back.GetCell(alone + i)
        assert [cell.GetPointId(j) for j in range(cell.GetNumberOfPoints())] == path.tolist()
