"""Several clouds of one object: how they are drawn, and how far answers to them are apart."""

import json

import numpy as np
import open3d as o3d
import pytest
from glsk_bench import repeat, run, sample, score_answers, spread
from glsk_bench.repeating import PLACES

from glsk_o3d import Skeleton, read_cloud
from glsk_o3d.errors import FileFormatError, InvalidParameterError


def line(*places, edges=None):
    nodes = np.array(places, float)
    edges = np.column_stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))]) if edges is None else edges
    return Skeleton(nodes, edges, np.ones(len(nodes)), (), (), ())


BAR = line((0, 0, 0), (20, 0, 0))
FORK = line((-20, 0, 0), (0, 0, 0), (20, 0, 0), (0, 20, 0), edges=[[0, 1], [1, 2], [1, 3]])


def moved(skeleton, by):
    return Skeleton(skeleton.vertices + by, skeleton.edges, skeleton.radii, (), (), ())


class TestSpread:
    def test_the_same_answers_are_not_apart(self):
        found = spread([FORK, FORK, FORK], 1.0, loops=0, ends=[3, 3])
        assert (found["moved"], found["agree"], found["loops"], found["ends"]) == (0, 1, 1, 1)
        assert (found["hooks"], found["tips"], found["failures"]) == (0, 9, 0)
        assert found["where"] == dict.fromkeys(PLACES, 0)
        assert found["found"] == [[1, 0, 3]] * 3

    @pytest.mark.parametrize(("by", "radius"), [(0.5, 1), (0.5, 0.25), (1.5, 1)])
    def test_a_shift_is_what_they_are_apart(self, by, radius):
        found = spread([BAR, moved(BAR, [0, 0, by])], radius)
        assert found["moved"] == pytest.approx(by / radius)
        assert (found["loops"], found["ends"]) == (None, None)
        assert found["where"]["ends"] == pytest.approx(by / radius * 4 * radius / 20, rel=0.05)  # of a length of twenty
        assert found["where"]["limbs"] == found["where"]["junctions"] == 0

    def test_a_limb_that_another_lacks(self):
        trunk = line((-20, 0, 0), (0, 0, 0), (20, 0, 0))
        found = spread([FORK, trunk], 1.0, loops=0, ends=[3, 4])
        assert found["agree"] == found["ends"] == 0.5
        limb = (20**2 / 2) / 60 / 2  # the mean of 0 to 20 on a third of the fork, of two ways
        assert found["moved"] == pytest.approx(limb, rel=1e-3)
        assert found["where"]["limbs"] == pytest.approx((20**2 - 2**2) / 2 / 60 / 2, rel=0.02)
        assert found["where"]["junctions"] == pytest.approx(2**2 / 2 / 60 / 2, rel=0.2)
        assert sum(found["where"].values()) == pytest.approx(found["moved"])

    @pytest.mark.parametrize("nothing", [None, Skeleton(np.empty((0, 3)), [], [], (), (), ())])
    def test_a_failure_agrees_with_nothing(self, nothing):
        found = spread([BAR, nothing, BAR], 1.0, loops=0, ends=[2, 2])
        assert (found["moved"], found["failures"]) == (0, 1)
        assert found["agree"] == found["loops"] == found["ends"] == pytest.approx(2 / 3)
        for few, agree in (([BAR, nothing], 0.5), ([nothing, nothing], 0)):
            found = spread(few, 1.0)
            assert (found["moved"], found["where"], found["agree"]) == (None, None, agree)


@pytest.fixture
def meshes(tmp_path):
    """A folder with a long box and a ring, of which something is known."""
    place = tmp_path / "meshes"
    place.mkdir()
    o3d.io.write_triangle_mesh(str(place / "box.ply"), o3d.geometry.TriangleMesh.create_box(6, 1, 1))
    o3d.io.write_triangle_mesh(str(place / "ring.obj"), o3d.geometry.TriangleMesh.create_torus(1, 0.25))
    rows = [dict(name="box", loops=0, ends=[2, 2], radius=0.5), dict(name="ring", loops=1, ends=None)]
    (place / "manifest.json").write_text(json.dumps({"meshes": rows}))
    return place


class TestSamples:
    def test_clouds_of_meshes(self, meshes, tmp_path):
        made = sample(tmp_path / "made", meshes, draws=2, n=800)
        assert [cloud.name for cloud in made.clouds] == ["box_0", "box_1", "ring_0", "ring_1"]
        assert (made.version, made.complete) == ("own", True)
        clouds = [np.asarray(read_cloud(cloud.path).points) for cloud in made.clouds]
        assert {len(points) for points in clouds} == {800}
        low, high = clouds[0].min(axis=0), clouds[0].max(axis=0)
        np.testing.assert_allclose([low, high], [[0, 0, 0], [6, 1, 1]], atol=0.05)
        assert np.abs(clouds[0] - clouds[1]).max() > 0.1
        facts = {name: [told[each] for each in ("radius", "loops", "ends")] for name, told in made.shapes.items()}
        assert facts["box"] == [0.5, 0, [2, 2]]
        assert facts["ring"] == [pytest.approx(0.25, rel=0.1), 1, None]

    def test_the_same_again_and_others_refused(self, meshes, tmp_path):
        made = sample(tmp_path / "made", meshes, draws=2, n=300)
        before = {path: path.stat().st_mtime_ns for path in (tmp_path / "made" / "clouds").iterdir()}
        again = sample(tmp_path / "made", meshes, draws=2, n=300)
        assert (again.shapes, again.name) == (made.shapes, made.name)
        assert before == {path: path.stat().st_mtime_ns for path in before}
        first = (tmp_path / "made" / "clouds" / "box_0.ply").read_bytes()
        (tmp_path / "made" / "clouds" / "box_0.ply").unlink()
        sample(tmp_path / "made", meshes, draws=2, n=300)
        assert (tmp_path / "made" / "clouds" / "box_0.ply").read_bytes() == first
        for other in (dict(n=301), dict(draws=3), dict(noise=0.01)):
            with pytest.raises(InvalidParameterError, match="has other clouds of box"):
                sample(tmp_path / "made", meshes, **(dict(draws=2, n=300) | other))

    def test_shapes_of_the_benchmark(self, rods, tmp_path):
        made = sample(tmp_path / "made", version="v1", draws=2, n=200)
        assert rods == ["figures_100", "frames_100", "groups_100", "handles_100", "trees_100", "tubes_100"]
        assert len(made.clouds) == 12
        told = made.shapes["trees_100"]
        assert (told["radius"], told["components"], told["loops"], told["ends"]) == (0.05, 1, 0, [2, 2])
        np.testing.assert_array_equal(made.truth("trees_100").radii, np.full(3, 0.05))

    @pytest.mark.parametrize(
        ("options", "said"), [(dict(draws=1), "draws = 1: must be at least 2"), (dict(noise=-0.1), "noise = -0.1")]
    )
    def test_wrong_options(self, meshes, tmp_path, options, said):
        with pytest.raises(InvalidParameterError, match=said):
            sample(tmp_path / "made", meshes, **options)

    def test_wrong_meshes(self, meshes, tmp_path):
        with pytest.raises(FileNotFoundError, match="has no meshes"):
            sample(tmp_path / "made", tmp_path / "none")
        for text in ("", '{"meshes": [{"name": "box", "loops": -1}]}'):
            (meshes / "manifest.json").write_text(text)
            with pytest.raises(FileFormatError, match=r"manifest\.json: is damaged"):
                sample(tmp_path / "made", meshes)
        (meshes / "manifest.json").unlink()
        (meshes / "box.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
        with pytest.raises(InvalidParameterError, match="'box' is no plain name, or that of two meshes"):
            sample(tmp_path / "made", meshes)


class TestRepeat:
    def test_from_meshes_to_figures(self, meshes, tmp_path):
        made = sample(tmp_path / "made", meshes, draws=2, n=800)
        assert run(made, tmp_path / "answers", jobs=2).failed == 0
        found = repeat(tmp_path / "made", tmp_path / "answers", name="mine")
        box, ring = found.rows
        assert (box["object"], box["draws"], box["radius"], box["loops"], ring["loops"]) == ("box", 2, 0.5, 1, 1)
        assert 0 < box["moved"] < 1
        means = found.means()
        assert (means["objects"], means["draws"], means["failures"], means["agree"]) == (2, 4, 0, 1)
        assert means["moved"] == means["median"] == pytest.approx((box["moved"] + ring["moved"]) / 2)
        found.save(tmp_path / "found.json")
        told = json.loads((tmp_path / "found.json").read_text())
        assert (told["name"], told["benchmark"], told["objects"]) == ("mine", made.name, found.rows)
        lines = found.markdown().splitlines()
        assert lines[4].startswith("| box | ")
        assert lines[-1].startswith("| mean | ")
        with pytest.raises(FileNotFoundError, match="has no true axis of box: 'glsk benchmark repeat'"):
            score_answers(made, tmp_path / "answers")

    def test_float32_is_compared_with_float64(self, meshes, tmp_path):
        made = sample(tmp_path / "made", meshes, draws=2, n=800, double=True)
        assert [cloud.name for cloud in made.clouds][:3] == ["box_0", "box_float64", "box_1"]
        exact, rounded = (np.asarray(read_cloud(cloud.path).points) for cloud in (made.clouds[1], made.clouds[0]))
        assert (exact != rounded).any()
        np.testing.assert_array_equal(exact.astype(np.float32), rounded.astype(np.float32))
        with pytest.raises(InvalidParameterError, match="has other clouds of box"):
            sample(tmp_path / "made", meshes, draws=2, n=800)
        assert run(made, tmp_path / "answers", jobs=2).failed == 0
        found = repeat(tmp_path / "made", tmp_path / "answers")
        box = found.rows[0]
        assert box["draws"] == len(box["found"]) == 2
        assert box["float32"]["moved"] < 1e-3 < box["moved"]
        assert box["float32"]["agree"] is True
        assert found.means()["float32"]["agree"] == 1
        assert found.markdown().splitlines()[2].endswith("| failures | float32 moved | float32 agrees |")
        next((tmp_path / "answers").glob("box_float64.*")).unlink()
        found = repeat(tmp_path / "made", tmp_path / "answers")
        assert found.rows[0]["float32"] == {"moved": None, "agree": False}
        assert found.means()["float32"]["agree"] == 0.5
        assert found.means()["failures"] == 0  # of the draws

    def test_failures_of_every_kind(self, small, perfect):
        """Of any folder with several clouds of a shape."""
        alone = small.shapes.pop("trees_101")  # of which one cloud is scored
        small.save()
        (perfect / "tubes_100_clean.obj").unlink()
        (perfect / "trees_100_clean.obj").write_text("rubbish")
        (perfect / "tubes_101_clean.obj").write_text("v 0 0 0\nv 1e8 0 0\nl 1 2\n")
        found = repeat(small.path, perfect)
        rows = {row["object"]: row for row in found.rows}
        assert rows.keys() == {"trees_100", "tubes_100", "tubes_101"}
        assert {(row["failures"], row["moved"], row["loops"]) for row in rows.values()} == {(1, None, 0.5)}
        means = found.means()
        assert means["moved"] is means["median"] is means["where"] is None
        assert "| mean | - | - | - | - | - | 0.50 | 0.50 | 0.50 |" in found.markdown()
        small.shapes["trees_101"] = alone
        small.save()
        with pytest.raises(InvalidParameterError, match="has one cloud of trees_101"):
            repeat(small.path, perfect)
