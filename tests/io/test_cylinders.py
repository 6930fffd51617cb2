"""Cylinders as other programs read them: by hand, and with readers that are not ours."""

import csv
import shutil
import subprocess
import warnings

import numpy as np
import pytest
from scipy.io import loadmat

from glsk_o3d import FileFormatError, InvalidParameterError, pipelines, samples
from glsk_o3d.analysis import Cylinders, cylinders
from glsk_o3d.io.cylinders import save_cylinders, tree_file, treeqsm_fields, treeqsm_table

TREEINFO_ADDS = {"volume", "diameter", "length", "strength", "min_strength", "dominance", "angle", "children", "branch"}
TREEINFO_ADDS |= {"branch_order", "extension", "pos_in_branch", "segment_length", "branch_angle"}


@pytest.fixture(scope="module")
def tree():
    """Cylinders of a tree with branches of several orders."""
    return cylinders(pipelines.tree("z")(samples.tree(6000, forks=4, seed=1).points))


@pytest.fixture
def two_branches():
    """A stem of two cylinders, and a twig that leaves it in the middle, between them in the table."""
    rows = [((0, 0, 0), (0, 0, 1), 0.5, 1.0, -1, 0, 0), ((0.5, 0, 1), (1.5, 0, 1), 0.25, 1.25, 0, 1, 1)]
    rows.append(((0, 0, 1), (0, 0, 2), 0.5, 1.0, 0, 2, 0))
    return Cylinders(*map(np.array, zip(*rows, strict=True)), np.ones(3))


def segments_of(data):
    """Of a tree file, as strictly as `ForestStructure::load` of raycloudtools reads it: names, and numbers."""
    names, line = [line for line in data.decode("ascii").splitlines() if not line.startswith("#")]
    assert names.startswith("x,y,z,radius,parent_id")
    names, words = names.split(","), line.split(",")
    assert all(word.strip().lstrip("-").isdigit() for word in words[4 :: len(names)])
    segments = np.array(words, float).reshape(-1, len(names))
    assert len(segments) > 1  # a root alone is refused where there are parents
    return names, segments


# ------------------------------------------------------------------------------------------------------------ treetools


def test_tree_file_by_hand(two_branches):
    line = "0.0,0.0,0.0,0.5,-1,0.0,0, 0.0,0.0,1.0,0.5,0,1.0,0, 1.5,0.0,1.0,0.25,1,1.25,1, 0.0,0.0,2.0,0.5,1,1.0,0\n"
    head = "# trees written by glsk-o3d, in metres\nx,y,z,radius,parent_id,curve_length,order\n"
    assert tree_file(two_branches).decode() == head + line
    assert tree_file(two_branches, two_branches).decode() == head + line + line


def test_tree_file_keeps_volume_and_parents(tree):
    names, segments = segments_of(tree_file(tree))
    assert not TREEINFO_ADDS & set(names)
    x, radius, parent, length = segments[:, :3], segments[1:, 3], segments[:, 4].astype(int), segments[1:, 5]
    np.testing.assert_array_equal(x, np.vstack([tree.start_point[:1], tree.end_point]))
    assert np.pi * (radius**2 * length).sum() == pytest.approx(tree.volume.sum(), rel=1e-12)
    assert length.sum() == pytest.approx(tree.length.sum(), rel=1e-12)
    assert parent[0] == -1
    np.testing.assert_array_equal(parent[1:], tree.parent + 1)
    assert (parent < np.arange(len(parent))).all()
    # treetools' own volume is from tip to tip, hence from the axis of the parent on: measured, 2.2 to 2.5 % above ours
    apart = np.linalg.norm(x[1:] - x[parent[1:]], axis=1)
    assert 1.01 < np.pi * (radius**2 * apart).sum() / tree.volume.sum() < 1.03
    np.testing.assert_array_less(np.linalg.norm(tree.end_point - tree.start_point, axis=1) - 1e-9, tree.length)


# -------------------------------------------------------------------------------------------------------------- TreeQSM


def test_table_of_treeqsm_by_hand(two_branches):
    assert treeqsm_table(two_branches).decode() == (
        "radius,length,start.x,start.y,start.z,axis.x,axis.y,axis.z,"
        "parent,extension,added,UnmodRadius,branch,BranchOrder,PositionInBranch\n"
        "0.5,1.0,0.0,0.0,0.0,0.0,0.0,1.0,0,2,0,0.5,1,0,1\n"
        "0.5,1.0,0.0,0.0,1.0,0.0,0.0,1.0,1,0,0,0.5,1,0,2\n"
        "0.25,1.25,0.5,0.0,1.0,1.0,0.0,0.0,1,0,0,0.25,2,1,1\n"
    )


def test_branches_of_treeqsm_are_axes(tree):
    table = {name: column.squeeze() for name, column in treeqsm_fields(tree).items()}
    number, parent, branch = np.arange(1, len(tree) + 1), table["parent"], table["branch"]
    assert (parent < number).all()
    assert (parent == 0).sum() == 1
    assert (np.diff(branch) >= 0).all()
    onward, first = np.flatnonzero(table["extension"]), table["PositionInBranch"] == 1
    np.testing.assert_array_equal(parent[table["extension"][onward] - 1], number[onward])
    assert first.sum() == branch.max()
    inside, begins = np.flatnonzero(~first), np.flatnonzero(first)[1:]
    np.testing.assert_array_equal(branch[inside], branch[parent[inside] - 1])
    np.testing.assert_array_equal(table["BranchOrder"][begins], table["BranchOrder"][parent[begins] - 1] + 1)
    np.testing.assert_allclose(np.linalg.norm(table["axis"], axis=1), 1)
    by_place = {tuple(place): row for row, place in enumerate(table["start"].tolist())}
    for start, before in zip(tree.start_point.tolist(), tree.parent.tolist(), strict=True):
        above = parent[by_place[tuple(start)]]
        assert above == 0 if before < 0 else table["start"][above - 1].tolist() == tree.start_point[before].tolist()


def test_several_cylinders_at_the_root_have_one_parent(two_branches):
    star = Cylinders(**{**vars(two_branches), "parent": np.array([-1, -1, 0]), "order": np.zeros(3, int)})
    assert treeqsm_fields(star)["parent"].ravel().tolist() == [0, 1, 1]
    assert treeqsm_fields(star)["branch"].ravel().tolist() == [1, 1, 2]


def test_matlab_file_in_the_functions_of_treeqsm(tree, tmp_path):
    save_cylinders(tree, tmp_path / "t.mat")
    read = loadmat(tmp_path / "t.mat", squeeze_me=True, simplify_cells=True)["cylinder"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        name, why = "PyTLidar.TreeQSMSteps.branches", "a reader of tests/readers.txt"
        branches = pytest.importorskip(name, reason=why, exc_type=ImportError).branches
    for index in ("parent", "extension", "branch"):
        read[index] = read[index].astype(int) - 1  # it counts from 0, as Python does
    found = branches(read)
    axes = treeqsm_fields(tree)["branch"].ravel()
    litres = 1000 * np.bincount(axes - 1, treeqsm_fields(tree)["radius"].ravel() ** 2 * np.pi * read["length"])
    np.testing.assert_allclose(found["volume"], litres, rtol=1e-6)  # in single precision
    assert found["volume"].sum() / 1000 == pytest.approx(tree.volume.sum(), rel=1e-6)
    assert found["length"].sum() == pytest.approx(tree.length.sum(), rel=1e-6)
    first = np.unique(axes, return_index=True)[1]
    np.testing.assert_array_equal(found["order"], treeqsm_fields(tree)["BranchOrder"].ravel()[first])


@pytest.mark.skipif(shutil.which("Rscript") is None, reason="needs R")
def test_table_of_treeqsm_in_r(tree, tmp_path):
    save_cylinders(tree, tmp_path / "t.qsm.csv", "m")
    (tmp_path / "read.R").write_text(
        """
        q <- read.csv("t.qsm.csv")
        # what rTwig 1.4 tells a table of TreeQSM by, and what its update_cylinders() then takes
        stopifnot(all(c("parent", "extension", "branch", "BranchOrder") %in% colnames(q)))
        ends <- q[c("start.x", "start.y", "start.z")] + q[c("axis.x", "axis.y", "axis.z")] * q$length
        stopifnot(all(is.finite(as.matrix(ends))), all(q$radius == q$UnmodRadius), q$PositionInBranch[1] == 1)
        stopifnot(all(q$parent < seq_len(nrow(q))), sum(q$parent == 0) == 1)
        cat(sprintf("%.15g\\n", c(sum(pi * q$radius^2 * q$length), sum(q$length), nrow(q), max(q$BranchOrder))))
        """
    )
    told = subprocess.run(["Rscript", "read.R"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    volume, length, rows, order = map(float, told.split())
    assert volume == pytest.approx(tree.volume.sum(), rel=1e-12)
    assert length == pytest.approx(tree.length.sum(), rel=1e-12)
    assert (rows, order) == (len(tree), tree.order.max())


# ---------------------------------------------------------------------------------------------------------------- files


def test_units_and_endings(two_branches, tmp_path):
    save_cylinders(two_branches, tmp_path / "t.csv", "cm")
    save_cylinders(two_branches, tmp_path / "t.txt", "cm")
    with (tmp_path / "t.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["length"]) for row in rows] == two_branches.length.tolist()
    assert [float(row["diameter"]) for row in rows] == [1.0, 0.5, 1.0]
    np.testing.assert_allclose([float(row["volume"]) for row in rows], two_branches.volume)
    segments = segments_of((tmp_path / "t.txt").read_bytes())[1]
    np.testing.assert_allclose(segments[1:, 5], two_branches.length / 100)
    with pytest.raises(FileFormatError, match=r"t\.xlsx: unknown ending; known are \.qsm\.csv, \.mat, \.txt, \.csv"):
        save_cylinders(two_branches, tmp_path / "t.xlsx")
    with pytest.raises(InvalidParameterError, match="unit = 'yard': must be metres"):
        save_cylinders(two_branches, tmp_path / "t.mat", "yard")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["t.csv", "t.txt"]
