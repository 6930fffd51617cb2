"""Trees as SWC, MTG and node lists of TomatoWUR: by hand, and as their own readers have them."""

import csv
import importlib
import io
import sys
import warnings
from unittest.mock import MagicMock

import numpy as np
import pytest

from glsk_o3d import FileFormatError, Skeleton, editing, pipelines, samples, save_skeleton
from glsk_o3d.analysis import branch_table
from glsk_o3d.io.formats import plants
from glsk_o3d.io.formats.plants import plant_axes
from glsk_o3d.io.skeletons import read_skeleton


def graph(places, edges, radii=0.1):
    return Skeleton(places, edges, np.full(len(places), radii, float), (), (), ())


def two_branches():
    """A stem of two pieces, and a thinner twig that leaves it in the middle."""
    return graph([[0, 0, 0], [0, 0, 1], [0, 0, 2], [1, 0, 1]], [[0, 1], [1, 2], [1, 3]], [0.2, 0.2, 0.2, 1e-9])


@pytest.fixture(scope="module")
def tree():
    """A tree with branches of several orders."""
    return editing.reroot(pipelines.tree("z")(samples.tree(6000, forks=4, seed=1).points), "z")


def reader(name, **instead):
    """A module of another program, as it comes: what it warns of is its own affair."""
    with warnings.catch_warnings(), pytest.MonkeyPatch.context() as patch:
        warnings.simplefilter("ignore")
        for module, stand_in in instead.items():
            patch.setitem(sys.modules, module, stand_in)
        return pytest.importorskip(name, reason="a reader of tests/readers.txt", exc_type=ImportError)


@pytest.fixture(scope="module")
def read_mtg_file():
    try:
        return importlib.import_module("openalea.mtg.io").read_mtg_file
    except ImportError:
        return reader("tomatowur.skeletonisation_methods.plantscan3d.io").read_mtg_file


@pytest.fixture(scope="module")
def skeleton_graph():
    """The class of TomatoWUR; its viewer has no part in reading."""
    reader("pandas")
    return reader("tomatowur.scripts.skeleton_graph", polyscope=MagicMock()).SkeletonGraph


def orders(parent, begins):
    order = np.zeros(len(parent), int)
    for vertex, before in enumerate(parent):
        order[vertex] = order[before] + begins[vertex] if before >= 0 else 0
    return order


# ------------------------------------------------------------------------------------------------------------------ SWC


def test_swc_as_others_write_it(tmp_path):
    path = tmp_path / "s.swc"
    path.write_bytes("# Bäume\n\n 30 3 1 1 1 0.5 7\n7 1 0 0 0 2 -1\n9 3 2 0 0 .5 30 extra\n".encode("latin-1"))
    back = read_skeleton(path)
    np.testing.assert_array_equal(back.edges, [[0, 1], [0, 2]])
    np.testing.assert_array_equal(back.radii, [0.5, 2, 0.5])


def test_swc_cuts_the_longest_edges_and_keeps_those_of_no_length(loop, make, tmp_path):
    save_skeleton(loop, tmp_path / "s.swc", cut_loops=True)
    tree = read_skeleton(tmp_path / "s.swc")
    assert (len(tree.edges), tree.n_loops, tree.n_components) == (len(loop.edges) - loop.n_loops, 0, 1)
    # Of two loops sharing the chord both the chord and one more edge go: the chord is the longest.
    lengths = np.sort(loop.edge_lengths)
    assert tree.length == pytest.approx(lengths[:5].sum())
    assert tree.edge_lengths.max() < lengths[-1]
    save_skeleton(make(np.zeros((3, 3)), [[0, 1], [1, 2]]), tmp_path / "s.swc")
    assert len(read_skeleton(tmp_path / "s.swc").edges) == 2


def test_coordinates_of_a_map_are_shifted_along_the_axes_that_need_it(tmp_path, caplog):
    far = graph([[5e5, 5.4e6, -0.05], [5e5 + 0.25, 5.4e6 + 0.125, 10.0]], [[0, 1]], 0.01)
    save_skeleton(far, tmp_path / "s.swc")
    assert "# global_shift: 500000.0 5400000.0 0.0" in (tmp_path / "s.swc").read_text()
    assert "global shift of (500000.00, 5400000.00, 0)" in caplog.text
    np.testing.assert_array_equal(read_skeleton(tmp_path / "s.swc").vertices, far.vertices)


# ----------------------------------------------------------------------------------------------------------------- axes


def test_orders_are_those_of_the_branch_table(tree):
    order, table = orders(*plant_axes(tree)), branch_table(tree, 0)
    assert table.order.max() > 3
    for row, path in enumerate(tree.branches):
        assert (order[path[path != table.start[row]]] == table.order[row]).all()


@pytest.mark.parametrize("root", [(0, 0, 1.5), (0, 0, 0.9), "-z"])
def test_one_edge_at_most_goes_on_wherever_the_root_is(root):
    line = np.column_stack([np.zeros((5, 2)), np.linspace(0, 2, 5)])
    places = np.concatenate([line, line[[1, 2]] @ [[0, 1, 0], [1, 0, 0], [1, 0, 0]] + [0, 0, 1]])
    rooted = editing.reroot(graph(places, [[0, 1], [1, 2], [2, 3], [3, 4], [2, 5], [5, 6]]), root)
    parent, begins = plant_axes(rooted)
    np.testing.assert_array_equal(parent[rooted.edges[:, 1]], rooted.edges[:, 0])
    assert parent[0] == -1
    goes_on = np.bincount(parent[1:][~begins[1:]], minlength=len(parent))
    ends = np.isin(np.arange(len(parent)), parent, invert=True)
    np.testing.assert_array_equal(goes_on, ~ends)
    assert begins.sum() + 1 == ends.sum()  # every axis has its end


def test_at_a_root_the_thickest_goes_on():
    star = graph(np.vstack([np.zeros(3), np.eye(3)]), [[0, 1], [0, 2], [0, 3]], [0.1, 0.1, 0.3, 0.1])
    assert plant_axes(star)[1].tolist() == [False, True, False, True]
    bare = graph(star.vertices, star.edges, np.nan)
    assert plant_axes(bare)[1].sum() == 2


# ------------------------------------------------------------------------------------------------------------------ MTG


def test_mtg_by_hand():
    rows = [
        "ENTITY-CODE\t\tXX\tYY\tZZ\tradius",
        "/P1/N0\t\t0.0\t0.0\t0.0\t0.2",
        "^<N1\t\t0.0\t0.0\t1.0\t0.2",
        "\t+N3\t1.0\t0.0\t1.0\t0.000000001",
        "^<N2\t\t0.0\t0.0\t2.0\t0.2",
    ]
    head = plants._MTG_HEADER + "\n"
    assert plants.write_mtg(two_branches()).decode() == head + "\n".join(rows) + "\n"
    assert plants.write_mtg(graph((), (), ())).decode() == head + "ENTITY-CODE\tXX\tYY\tZZ\tradius\n"


def test_mtg_in_the_reader_of_openalea(tree, read_mtg_file, tmp_path):
    two = editing.reroot(
        Skeleton(
            np.concatenate([tree.vertices, tree.vertices * 1e-7 + 50]),
            np.concatenate([tree.edges, tree.edges + len(tree.vertices)]),
            np.concatenate([tree.radii, np.full(len(tree.radii), np.nan)]),
            *((),) * 3,
        ),
        "z",
    )
    (tmp_path / "t.mtg").write_bytes(plants.write_mtg(two))
    g = read_mtg_file(str(tmp_path / "t.mtg"))
    assert (g.max_scale(), g.nb_vertices(scale=1), g.nb_vertices(scale=2)) == (2, 2, len(two.vertices))
    number = {vertex: int(g.property("index")[vertex]) for vertex in g.vertices(scale=2)}
    parent, begins = plant_axes(two)
    place = np.full((len(two.vertices), 4), np.nan)
    for vertex, i in number.items():
        place[i] = [g.property(name).get(vertex, np.nan) for name in ("XX", "YY", "ZZ", "radius")]
        before = g.parent(vertex)
        assert (-1 if before is None else number[before]) == parent[i]
        assert before is None or g.edge_type(vertex) == "<+"[int(begins[i])]
    np.testing.assert_array_equal(place, np.column_stack([two.vertices, two.radii]))


# ------------------------------------------------------------------------------------------------------------ TomatoWUR


def test_node_list_by_hand():
    assert plants.write_csv(two_branches()).decode() == (
        "x,y,z,x_skeleton,y_skeleton,z_skeleton,vid,parentid,edgetype,radius\n"
        "0.0,0.0,0.0,0.0,0.0,0.0,0,,,0.2\n"
        "0.0,0.0,1.0,0.0,0.0,1.0,1,0,<,0.2\n"
        "0.0,0.0,2.0,0.0,0.0,2.0,2,1,<,0.2\n"
        "1.0,0.0,1.0,1.0,0.0,1.0,3,1,+,1e-09\n"
    )


@pytest.mark.parametrize("load", ["load_csv", "from_nodelist", "from_skeleton_gt_data", "from_mtg"])
def test_trees_in_tomatowur(tree, skeleton_graph, load, tmp_path):
    path = tmp_path / ("t.mtg" if load == "from_mtg" else "t.plant.csv")
    save_skeleton(tree, path)
    given = str(path) if load == "from_mtg" else path
    found = skeleton_graph(path) if load == "load_csv" else getattr(skeleton_graph, load)(given)
    ends = found.get_node_attribute("pos")[found.get_edges()]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(tree.length, rel=1e-12)
    if load != "from_mtg":
        found.get_node_order()  # fails on what is not a tree from node 0
        written = {tuple(pair) for pair in np.round(tree.vertices[tree.edges], 9).reshape(-1, 6).tolist()}
        assert {tuple(pair) for pair in np.round(ends, 9).reshape(-1, 6).tolist()} == written
        assert sorted(found.get_node_attribute("node_order")) == sorted(orders(*plant_axes(tree)))


def test_node_list_holds_one_plant_and_leaves_out_what_is_not_known():
    two = graph([[0, 0, 0], [0, 0, 1]], np.empty((0, 2), int))
    with pytest.raises(FileFormatError, match="one plant and the skeleton has 2 components"):
        plants.write_csv(two)
    bare = graph([[0, 0, 0], [0, 0, 1]], [[0, 1]], np.nan)
    rows = list(csv.DictReader(io.StringIO(plants.write_csv(bare).decode())))
    assert [row["radius"] for row in rows] == ["", ""]
