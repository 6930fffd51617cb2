"""A benchmark of somebody's own clouds and axes: what is written, what is refused, radii from clouds, and scores."""

import json
import sys

import numpy as np
import pytest
from glsk_bench import add_shape, make, read_folder, run, score_answers
from glsk_bench.folders import INDEX_NAME
from glsk_bench.radii import radii_from_points

from glsk_o3d import read_cloud, samples
from glsk_o3d.errors import InvalidParameterError

FORK = samples.y_junction(900)
AXIS = (FORK.nodes, FORK.edges, FORK.radii)


@pytest.fixture
def own(tmp_path):
    """Two shapes, in units of their own."""
    add_shape(tmp_path / "own", "zig", {"scan": 40 * FORK.points}, 40 * FORK.nodes, FORK.edges, 40 * FORK.radii)
    clouds = {"late": FORK.points[::2], "early": FORK.points}
    return add_shape(tmp_path / "own", "a.fork", clouds, *AXIS, family="forks")


class TestFolder:
    def test_what_is_in_it(self, own, everything):
        clouds = ["a.fork_late", "a.fork_early", "zig_scan"]  # variants as they were added
        files = [INDEX_NAME, *(f"clouds/{name}.ply" for name in clouds), "truth/a.fork.npz", "truth/zig.npz"]
        assert sorted(everything(own.path)) == sorted(files)
        again = read_folder(own.path)
        assert [cloud.name for cloud in again.clouds] == [cloud.name for cloud in again.scored] == clouds
        assert [cloud.family for cloud in again.clouds] == ["forks", "forks", "own"]
        assert (again.version, again.whole, again.complete, again.name) == ("own", False, True, own.name)
        told = json.loads((own.path / INDEX_NAME).read_text())
        assert not {"points", "draw", "least_coverage"} & told.keys()
        assert told["shapes"]["zig"]["radii"] == "given"

    def test_clouds_and_axes_keep_their_units(self, own):
        np.testing.assert_array_equal(
            np.asarray(read_cloud(own.path / "clouds/zig_scan.ply").points, np.float32), np.float32(40 * FORK.points)
        )
        truth = own.truth("zig")
        np.testing.assert_array_equal(truth.nodes, 40 * FORK.nodes)
        np.testing.assert_array_equal(truth.radii, 40 * FORK.radii)

    def test_coordinates_on_a_map_keep_their_digits(self, tmp_path):
        place = np.array([5e5, 5e6, 0])
        add_shape(tmp_path, "far", {"scan": FORK.points + place}, FORK.nodes + place, FORK.edges)
        path = tmp_path / "clouds/far_scan.ply"
        assert b"property double x" in path.read_bytes()[:200]
        np.testing.assert_array_equal(np.asarray(read_cloud(path).points), FORK.points + place)


class TestRefusals:
    @pytest.mark.parametrize("name", ["", ".hidden", "../a", "a b", "a\n", 3])
    def test_names_that_are_not_plain(self, tmp_path, name):
        for words in ((name, {"scan": FORK.points}, "own"), ("a", {name: FORK.points}, "own"), ("a", {"b": []}, name)):
            with pytest.raises(InvalidParameterError, match="no plain name"):
                add_shape(tmp_path / "own", words[0], words[1], *AXIS, family=words[2])
        assert not (tmp_path / "own").exists()

    @pytest.mark.parametrize(
        ("shape", "variant", "said"), [("A.fork", "x", "one file"), ("a.fork", "Late", "name of two clouds")]
    )
    def test_names_of_other_clouds(self, own, shape, variant, said):
        with pytest.raises(InvalidParameterError, match=said):
            add_shape(own.path, shape, {variant: FORK.points}, *AXIS)

    def test_other_points_or_another_axis(self, own, everything):
        before = everything(own.path)
        with pytest.raises(InvalidParameterError, match=r"other points for a\.fork_late"):
            add_shape(own.path, "a.fork", {"late": FORK.points[1::2]}, *AXIS)
        for axis in ((2 * AXIS[0], *AXIS[1:]), (*AXIS[:2], 2 * AXIS[2]), (AXIS[0] + 1e-3, AXIS[1])):
            with pytest.raises(InvalidParameterError, match=r"a\.fork with another axis"):
                add_shape(own.path, "a.fork", {"new": FORK.points}, *axis)
        assert everything(own.path) == before

    def test_versions_are_not_mixed(self, own, small):
        with pytest.raises(InvalidParameterError, match="has clouds of somebody's own, not v1"):
            make(own.path, families=["tubes"], seeds=[100], variants=["clean"], jobs=1)
        with pytest.raises(InvalidParameterError, match="has version v1, not own"):
            add_shape(small.path, "fork", {"scan": FORK.points}, *AXIS)

    @pytest.mark.parametrize(
        ("clouds", "axis", "said"),
        [
            ({}, AXIS, "no cloud is given"),
            ({"a": FORK.points * np.nan}, AXIS, "not finite"),
            ({"a": FORK.points}, (AXIS[0], [[0, 99]]), "fork: .*missing vertex"),
            ({"a": FORK.points}, ("nodes", []), "fork: the axis has invalid nodes"),
            ({"a": FORK.points}, (*AXIS[:2], 0 * AXIS[2]), "fork: .*positive"),
            ({"a": FORK.points}, (AXIS[0] + 99, AXIS[1]), "fork: the axis has no points near"),
            ({"a": FORK.points[:2]}, AXIS[:2], "fork: no node of the axis has 3 points"),
            ({"a": 1000 * FORK.points}, AXIS, r"fork_a: the cloud is .* the same units"),
        ],
    )
    def test_clouds_and_axes_of_no_use(self, tmp_path, clouds, axis, said):
        with pytest.raises(InvalidParameterError, match=said):
            add_shape(tmp_path, "fork", clouds, *axis)
        assert not (tmp_path / INDEX_NAME).exists()


class TestAnswers:
    def test_to_another_cloud_of_the_same_name_do_not_count(self, tmp_path):
        """What was answered in one folder is no answer to what is called the same in another."""
        turned = FORK.points[:, [1, 2, 0]], FORK.nodes[:, [1, 2, 0]]
        one = add_shape(tmp_path / "one", "fork", {"scan": FORK.points}, *AXIS)
        two = add_shape(tmp_path / "two", "fork", {"scan": turned[0]}, turned[1], FORK.edges, FORK.radii)
        command = [sys.executable, "-c", COPIES, "{cloud}", "{skeleton}"]
        options = dict(command=command, ending=".obj")
        assert run(one, tmp_path / "answers", **options).skipped == 0
        assert score_answers(one, tmp_path / "answers").failures == 0
        (row,) = score_answers(two, tmp_path / "answers").rows
        assert row["failure"] == "no answer: what is there answers another cloud of this name"
        assert run(two, tmp_path / "answers", **options).skipped == 0
        assert score_answers(two, tmp_path / "answers").failures == 0
        assert run(two, tmp_path / "answers", **options).skipped == 1
        add_shape(tmp_path / "two", "fork", {"more": turned[0][:500]}, turned[1], FORK.edges, FORK.radii)
        assert run(tmp_path / "two", tmp_path / "answers", **options).skipped == 1


COPIES = """
import sys
open(sys.argv[2], "w").write("v 0 0 0\\nv 1 0 0\\nl 1 2\\n")
"""


class TestRadii:
    def test_of_a_tube_that_widens(self):
        """Around each node the points are as far as the cone is thick, whatever part of the edges they are beside."""
        t, turn = np.random.default_rng(0).random((2, 4000)) * [[10], [2 * np.pi]]
        radius = 0.5 + 0.1 * t
        points = np.column_stack([t, radius * np.cos(turn), radius * np.sin(turn)])
        nodes = np.column_stack([np.arange(11.0), np.zeros((11, 2))])
        found = radii_from_points(nodes, np.column_stack([np.arange(10), np.arange(1, 11)]), points)
        np.testing.assert_allclose(found[1:-1], 0.5 + 0.1 * nodes[1:-1, 0], rtol=0.02)

    def test_nodes_without_points_have_those_of_the_next_along_the_axis(self):
        """A twig beside a trunk: its bare tip is as thick as its foot, not as the trunk that it comes near to."""
        turn = np.linspace(0, 60, 600)
        trunk = np.column_stack([2 * np.cos(turn), 2 * np.sin(turn), np.linspace(0, 10, 600)])
        twig = np.column_stack([8 + 0.1 * np.cos(turn), 0.1 * np.sin(turn), np.linspace(0, 3, 600)])
        nodes = np.array([[0, 0, 0], [0, 0, 10], [8, 0, 0], [8, 0, 3], [4.5, 0, 9], [60, 0, 0]], float)
        edges = np.array([[0, 1], [2, 3], [3, 4]])
        found = radii_from_points(nodes, edges, np.vstack([trunk, twig]))
        np.testing.assert_allclose(found, [2, 2, 0.1, 0.1, 0.1, 0.1], atol=0.01)  # the last has no edge: straight

    def test_a_ball(self):
        ball = samples.sphere(500).points
        np.testing.assert_allclose(radii_from_points(np.zeros((1, 3)), np.empty((0, 2), int), ball), [0.5], rtol=0.01)
