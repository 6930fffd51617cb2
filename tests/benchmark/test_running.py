"""Running programs: ours, those of the page, good ones, and those that fail, hang, write rubbish, or take too much."""

import json
import re
import sys
import time

import numpy as np
import pytest
from glsk_bench import make, run, score_answers
from glsk_bench.running import CAN_LIMIT_MEMORY, RunResult

from glsk_o3d import pipelines, read_cloud, read_skeleton
from glsk_o3d.errors import InvalidParameterError

ODD = """
if name == "trees_100_clean":
    print("first line")
    sys.exit("it is too hard")
if name == "trees_100_scan2":
    open(skeleton, "w").write("rubbish")
elif name == "trees_101_clean":
    pass
elif name == "tubes_100_clean":
    write(skeleton)
    os.kill(os.getpid(), 9)
elif name == "tubes_100_scan2":
    os.mkdir(skeleton)
elif name == "tubes_101_clean":
    open(skeleton, "w").close()
else:
    write(skeleton)
"""


@pytest.fixture
def go(small, tmp_path):
    """Run a command over the small benchmark; OBJ files into the folder `out`."""

    def start(words, **options):
        return run(small, tmp_path / "out", command=words, ending=".obj", **options)

    return start


def times_in(place):
    return json.loads((place / "times.json").read_text())["clouds"]


def test_a_good_program(go, small, program, tmp_path):
    told = []
    result = go(program("write(skeleton)"), on_cloud=lambda name, outcome, done, n: told.append((name, done, n)))
    assert result == RunResult(7, 0, 0, {})
    assert told == [(cloud.name, done, 7) for done, cloud in enumerate(small.scored, 1)]
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == sorted([*(f"{cloud.name}.obj" for cloud in small.scored), "times.json"])
    assert all(0 < each["seconds"] < 60 and each["failure"] is None for each in times_in(tmp_path / "out").values())
    results = score_answers(small, tmp_path / "out")
    assert results.failures == 0
    assert all(row["seconds"] > 0 for row in results.rows)


def test_every_way_to_fail_has_its_reason(go, small, program, tmp_path):
    result = go(program(ODD), jobs=2)
    assert (result.done, result.failed) == (1, 6)
    said = result.failures
    assert said["trees_100_clean"] == "exit code 1: it is too hard"
    assert said["trees_100_scan2"].startswith("it wrote no skeleton: ")
    assert said["trees_101_clean"] == said["tubes_100_scan2"] == "it wrote no skeleton"
    assert said["tubes_100_clean"] == "killed by SIGKILL"
    assert said["tubes_101_clean"].startswith("it wrote no skeleton: ")
    assert not any(str(tmp_path) in words for words in said.values())
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["times.json", "tubes_101_scan2.obj"]
    rows = score_answers(small, tmp_path / "out").rows
    assert [row["failure"] is None for row in rows].count(True) == 1
    assert (
        next(row for row in rows if row["shape"] == "trees_100")["failure"] == f"no answer: {said['trees_100_clean']}"
    )


def test_one_that_hangs_is_killed_with_its_children(go, program, tmp_path):
    child = f"open({str(tmp_path / 'late')!r}, 'w')"
    source = f"""
    import subprocess
    write(skeleton)
    if name == "trees_100_clean":
        subprocess.run([sys.executable, "-S", "-E", "-c", "import time; time.sleep(2); {child}"])
    """
    start = time.perf_counter()
    result = go(program(source), time_limit=0.7)
    assert result.failures == {"trees_100_clean": "not done after 0.7 s"}
    assert 0.7 <= times_in(tmp_path / "out")["trees_100_clean"]["seconds"] < 2
    time.sleep(max(0, 2.5 - (time.perf_counter() - start)))
    assert not (tmp_path / "late").exists()


@pytest.mark.skipif(not CAN_LIMIT_MEMORY, reason="this system cannot limit the memory of another process")
def test_one_that_takes_too_much_memory(go, program):
    source = """
    time.sleep(0.2)
    if name == "trees_100_clean":
        room = bytearray(10**9)
    write(skeleton)
    """
    assert go(program(source), memory_limit=0.5).failures == {"trees_100_clean": "exit code 1: MemoryError"}


def test_an_interrupted_run_goes_on(go, program, tmp_path):
    words = program("write(skeleton)\nif name == 'trees_100_clean': sys.exit(1)")

    def interrupt(name, outcome, done, total):
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        go(words, on_cloud=interrupt)
    place = tmp_path / "out"
    assert len(times_in(place)) == 3
    assert not [path for path in place.iterdir() if path.name.startswith(".run_")]
    told = []
    result = go(words, on_cloud=lambda name, *_: told.append(name))
    assert (result.done, result.failed, result.skipped, len(told)) == (6, 1, 3, 4)
    told.clear()
    assert go(words, on_cloud=lambda name, *_: told.append(name)).skipped == 7
    assert told == []
    (place / "tubes_101_clean.obj").unlink()  # what is lost is done again, and with retry also what failed
    assert go(words, retry=True, on_cloud=lambda name, *_: told.append(name)).skipped == 5
    assert told == ["trees_100_clean", "tubes_101_clean"]


def test_answers_of_another_program_are_not_mixed_in(go, program, small, perfect, tmp_path):
    words = program("write(skeleton)")
    go(words)
    for other, options in ((program("write(skeleton)", "--fast"), {}), (words, dict(time_limit=7))):
        with pytest.raises(InvalidParameterError, match="answers of another program"):
            go(other, **options)
    with pytest.raises(InvalidParameterError, match="answers of another program"):
        run(small, perfect, command=words, ending=".obj")
    assert len(list(perfect.iterdir())) == 7


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (dict(command="true {cloud}"), r"has no \{skeleton\}"),
        (dict(command="true '{cloud} {skeleton}"), "malformed"),
        (dict(command="no_such_program {cloud} {skeleton}"), "no program 'no_such_program'"),
        (dict(command="true {cloud} {skeleton}", pipeline="default"), "give one of them"),
        (dict(time_limit=0), "above 0"),
        (dict(jobs=0), "1 or more"),
    ],
)
def test_wrong_words(small, tmp_path, options, said):
    with pytest.raises(InvalidParameterError, match=said):
        run(small, tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


def test_our_pipelines_run_as_commands(rods, tmp_path):
    made = make(tmp_path / "bench", families=["tubes"], seeds=[100], variants=["clean"], jobs=1)
    assert run(made, tmp_path / "ours", pipeline="default") == RunResult(1, 0, 0, {})
    found = read_skeleton(tmp_path / "ours" / "tubes_100_clean.ply")
    expected = pipelines.default()(read_cloud(made.clouds[0].path))
    assert (found.vertices == expected.vertices).all()
    assert json.loads((tmp_path / "ours" / "times.json").read_text())["program"]["pipeline"] == "default"


@pytest.fixture
def page(root):
    text = (root / "docs" / "benchmark.md").read_text()
    return lambda language: re.search(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)[1]


def longest(points):
    """The ends of a cloud along its longest axis, in either order."""
    middle = points.mean(axis=0)
    axis = np.linalg.svd(points - middle, full_matrices=False)[2][0]
    along = (points - middle) @ axis
    ends = middle + np.outer([along.min(), along.max()], axis)
    return ends[ends[:, 0].argsort()]


def test_the_python_program(page, small, tmp_path):
    (tmp_path / "mine.py").write_text(page("py"))
    words = f"{sys.executable} {tmp_path / 'mine.py'} {{cloud}} {{skeleton}}"
    assert run(small, tmp_path / "mine", command=words, ending=".obj").failures == {}
    cloud = small.scored[-1]
    found = read_skeleton(tmp_path / "mine" / f"{cloud.name}.obj").vertices
    expected = longest(np.asarray(read_cloud(cloud.path).points))
    np.testing.assert_allclose(found[found[:, 0].argsort()], expected, atol=1e-6)
    assert all(row["perfect"] for row in score_answers(small, tmp_path / "mine").rows)
