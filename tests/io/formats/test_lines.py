"""OBJ and VTP: as others write them, and as others read ours."""

import numpy as np
import pytest

from glsk_o3d import save_skeleton
from glsk_o3d.io.skeletons import read_skeleton


@pytest.mark.parametrize("ending", [".obj", ".ply"])
def test_meshlab_opens_it(skeleton, tmp_path, ending):
    pymeshlab = pytest.importorskip("pymeshlab")
    save_skeleton(skeleton, tmp_path / f"s{ending}")
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(tmp_path / f"s{ending}"))
    mesh = meshes.current_mesh()
    np.testing.assert_array_equal(mesh.vertex_matrix(), skeleton.vertices)
    np.testing.assert_array_equal(mesh.edge_matrix().reshape(-1, 2), skeleton.edges)
    if ending == ".ply":  # it colours by them
        np.testing.assert_array_equal(mesh.vertex_scalar_array(), skeleton.radii)


def test_obj_as_others_write_it(tmp_path):
    (tmp_path / "s.obj").write_text(
        "# x\no name\nv 0 0 0 1\nv 1 0 0\nvn 0 0 1\nv 2 0 0\nl 1/1 2/1 3/2 # c\nl -1 -3\ng\n"
    )
    back = read_skeleton(tmp_path / "s.obj")
    np.testing.assert_array_equal(back.vertices, [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    np.testing.assert_array_equal(back.edges, [[0, 1], [0, 2], [1, 2]])


def test_vtk_reads_vertices_branches_and_radii(skeleton, tmp_path):
    reader_module = pytest.importorskip("vtkmodules.vtkIOXML", reason="vtk is not installed")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    save_skeleton(skeleton, tmp_path / "s.vtp")
    reader = reader_module.vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "s.vtp"))
    reader.Update()
    back = reader.GetOutput()
    np.testing.assert_array_equal(vtk_to_numpy(back.GetPoints().GetData()), skeleton.vertices)
    for name, values in (("radius", skeleton.radii), ("confidence", skeleton.confidence)):
        np.testing.assert_array_equal(vtk_to_numpy(back.GetPointData().GetArray(name)), values)
    alone = int((skeleton.degree == 0).sum())
    cells = vtk_to_numpy(back.GetCellData().GetArray("branch"))
    np.testing.assert_array_equal(cells, [*[-1] * alone, *range(len(skeleton.branches))])
    assert back.GetNumberOfVerts() == alone
    for i, path in enumerate(skeleton.branches):
        cell = back.GetCell(alone + i)
        assert [cell.GetPointId(j) for j in range(cell.GetNumberOfPoints())] == path.tolist()
