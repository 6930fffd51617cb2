import numpy as np
import pytest


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
