import networkx
import numpy as np
import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.skeletons import read_skeleton


def test_graphml_as_others_write_it(tmp_path):
    graph = networkx.MultiDiGraph()
    graph.add_nodes_from([("a", dict(x=0, y=0.5, z=1)), ("b", dict(x=1.0, y=1.0, z=1.0, radius=2.0))])
    graph.add_edges_from([("b", "a"), ("a", "b"), ("a", "a")])
    networkx.write_graphml_xml(graph, tmp_path / "s.graphml")
    back = read_skeleton(tmp_path / "s.graphml")
    np.testing.assert_array_equal(back.edges, [[0, 1]])
    np.testing.assert_array_equal(back.radii, [np.nan, 2])


def test_graphml_in_networkx(tree, tmp_path):
    tree.save(tmp_path / "s.graphml")
    graph = networkx.read_graphml(tmp_path / "s.graphml", node_type=int)
    assert [graph.nodes[i]["radius"] for i in range(6)] == tree.radii.tolist()
    assert [graph.edges[edge]["length"] for edge in tree.edges.tolist()] == tree.edge_lengths.tolist()


def test_graphml_without_coordinates(tmp_path):
    networkx.write_graphml_xml(networkx.path_graph(2), tmp_path / "s.graphml")
    with pytest.raises(FileFormatError, match=r"node '0'.* x, y or z"):
        read_skeleton(tmp_path / "s.graphml")
