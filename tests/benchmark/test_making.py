"""Making a benchmark: what is in the folder, going on, and what is refused."""

import json
import sys

import numpy as np
import pytest
from glsk_bench import make, read_folder, versions
from glsk_bench.folders import INDEX_NAME
from glsk_bench.shapes import shape
from glsk_bench.truths import THING_ARRAYS, ThingTruth

from glsk_o3d.errors import FileFormatError, InvalidParameterError

CHOICE = dict(families=["tubes", "trees"], seeds=[100, 101], variants=["clean", "scan2"], jobs=1)


def test_what_is_in_the_folder(small, everything):
    shapes = ["trees_100", "trees_101", "tubes_100", "tubes_101"]
    clouds = [f"clouds/{shape}_{variant}.ply" for shape in shapes for variant in ("clean", "scan2")]
    assert sorted(everything(small.path)) == [INDEX_NAME, *clouds, *(f"truth/{shape}.npz" for shape in shapes)]
    assert [cloud.path.relative_to(small.path).as_posix() for cloud in small.clouds] == clouds
    assert [cloud.name for cloud in small.clouds if not cloud.scored] == ["trees_101_scan2"]
    told = json.loads((small.path / INDEX_NAME).read_text())
    assert (told["version"], told["complete"], told["whole"], told["points"]) == ("v1", True, False, 4096)
    tree = told["shapes"]["trees_101"]
    assert (tree["family"], tree["seed"]) == ("trees", 101)
    assert tree["facts"] == {"length": 0.8, "loops": 0, "many": [0, 1]}
    assert [tree["clouds"][variant]["coverage"] for variant in ("clean", "scan2")] == [1.0, 0.5]
    assert tree["clouds"]["clean"]["sameness"] is None
    again = read_folder(small.path)
    assert (again.version, again.shapes, again.complete) == ("v1", small.shapes, True)


def test_an_interrupted_one_goes_on(small, rods, everything, tmp_path):
    expected = everything(small.path)
    rods.clear()

    def interrupt(name, done, total):
        assert total == 4
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make(tmp_path / "again", **CHOICE, on_shape=interrupt)
    assert not read_folder(tmp_path / "again").complete
    assert rods == ["tubes_100", "tubes_101"]
    told = []
    make(tmp_path / "again", **CHOICE, on_shape=lambda *words: told.append(words))
    assert rods == ["tubes_100", "tubes_101", "trees_100", "trees_101"]
    assert told == [("trees_100", 1, 2), ("trees_101", 2, 2)]
    assert everything(tmp_path / "again") == expected


@pytest.mark.parametrize("lost", ["clouds/tubes_100_scan2.ply", "truth/tubes_100.npz"])
def test_what_is_lost_is_made_again(small, rods, everything, lost):
    before = everything(small.path)
    (small.path / lost).unlink()
    rods.clear()
    make(small.path, **CHOICE)
    assert rods == ["tubes_100"]
    assert everything(small.path) == before


def test_sameness_is_told(rods, tmp_path, monkeypatch):
    made = make(tmp_path / "a", families=["tubes"], seeds=[100, 101], variants=["clean"], jobs=1)
    words = made.shapes["tubes_100"]["clouds"]["clean"]["fingerprint"]
    near = " ".join(["00000000", *words.split()[1:]])
    known = {"tubes_100_clean": words, "tubes_101_clean": words, "tubes_102_clean": near}
    monkeypatch.setattr(versions, "fingerprints", lambda name: known)
    again = make(tmp_path / "b", families=["tubes"], seeds=[100, 101, 103], variants=["clean"], jobs=1)
    said = [told["clouds"]["clean"]["sameness"] for told in again.shapes.values()]
    assert said == ["bits", "other", None]


def test_a_cloud_that_cannot_be_made_is_told_and_not_tried_again(rods, tmp_path, monkeypatch):
    clouds = sys.modules["glsk_bench.clouds"]
    drawn = clouds.cloud

    def cloud(shape, variant, n=4096, seed=0):
        if (shape.name, variant) == ("trees_101", "scan2"):
            raise InvalidParameterError("too little is seen")
        return drawn(shape, variant, n, seed)

    monkeypatch.setattr(clouds, "cloud", cloud)
    made = make(tmp_path / "bench", **CHOICE)
    assert len(made.clouds) == 7
    assert made.shapes["trees_101"]["not_made"] == {"scan2": "too little is seen"}
    rods.clear()
    make(tmp_path / "bench", **CHOICE)
    assert rods == []


def test_things_and_what_is_known_of_them(tmp_path):
    made = make(tmp_path, "v2", families=["plates"], seeds=[110], variants=["clean", "depth2"], jobs=1)
    told, drawn, truth = made.shapes["plates_110"], shape("plates", 110), made.truth("plates_110")
    assert list(told["clouds"]) == ["clean"]  # of the other, two cameras see too little
    assert told["clouds"]["clean"]["sameness"] in ("bits", "rounding")
    assert isinstance(truth, ThingTruth)
    for name in ("nodes", "edges", "radii", *THING_ARRAYS):
        np.testing.assert_array_equal(getattr(truth, name), getattr(drawn, name))
    assert "half_width" in json.loads((tmp_path / INDEX_NAME).read_text())["explained"]["truth/SHAPE.npz"]


def test_toys_and_rings_are_what_is_known(tmp_path):
    variants = ["clean", "scan2", "flying"]
    made = make(tmp_path, "v3", families=["toys", "rings"], seeds=[101], variants=variants, jobs=1)
    same = [cloud["sameness"] for told in made.shapes.values() for cloud in told["clouds"].values()]
    assert len(same) == 6
    assert set(same) <= {"bits", "rounding"}


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (dict(version="v9"), "no version of the benchmark is called 'v9'"),
        (dict(families=["tube"]), "did you mean 'tubes'"),
        (dict(variants=[]), "no variant is given"),
        (dict(seeds=[-1]), "whole numbers from 0"),
        (dict(jobs=0), "1 or more"),
    ],
)
def test_wrong_words(rods, tmp_path, wrong, said):
    with pytest.raises(InvalidParameterError, match=said):
        make(tmp_path / "new", **{**CHOICE, **wrong})
    assert rods == []


def test_a_folder_without_an_index(tmp_path):
    with pytest.raises(FileNotFoundError, match="glsk benchmark make"):
        read_folder(tmp_path)


@pytest.mark.parametrize(("part", "name"), [("file", "../secret.ply"), ("truth", "truth/../x.npz")])
def test_an_index_leads_nowhere_else(small, part, name):
    told = json.loads((small.path / INDEX_NAME).read_text())
    tube = told["shapes"]["tubes_100"]
    (tube if part == "truth" else tube["clouds"]["clean"])[part] = name
    (small.path / INDEX_NAME).write_text(json.dumps(told))
    with pytest.raises(FileFormatError, match="damaged"):
        read_folder(small.path)


def test_in_two_processes_it_is_the_same_and_what_is_known(everything, tmp_path):
    pytest.importorskip("glsk_bench.shapes")  # what is drawn, not the rods of the other tests
    choice = dict(families=["tubes", "handles"], seeds=[100], variants=["noise1", "depth2"])
    alone, together = (make(tmp_path / str(jobs), **choice, jobs=jobs) for jobs in (1, 2))
    assert everything(alone.path) == everything(together.path)
    same = [cloud["sameness"] for told in together.shapes.values() for cloud in told["clouds"].values()]
    assert len(same) == 4
    assert set(same) <= {"bits", "rounding"}  # as the package knows them
