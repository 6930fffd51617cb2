"""What a hostile file, name or number must not do: reach the terminal, end in a traceback, or spoil JSON."""

import json
import logging

import numpy as np
import pytest
import typer

from glsk_o3d import InvalidParameterError, RingBuilder, Skeleton, Thinner, Tracer, save_skeleton
from glsk_o3d.cli.console import echo, print_json, print_rows, print_table, say, visible
from glsk_o3d.cli.reporting import reporting
from glsk_o3d.errors import FileFormatError
from glsk_o3d.parameters import shown
from glsk_o3d.samples import torus

NASTY = "a\x1b[2J\x1b]0;title\x07\x9b31m\rbc\x7f"
HARMLESS = r"a\x1b[2J\x1b]0;title\x07\x9b31m\rbc\x7f"


def commands(text):
    """Characters that a terminal would obey."""
    return [sign for sign in text if sign in NASTY and not sign.isprintable()]


def test_whatever_prints(capfd):
    assert visible(NASTY) == visible(HARMLESS) == HARMLESS
    assert visible("Größe 3 µm\n\tü") == "Größe 3 µm\n\tü"
    echo(NASTY)
    say("error", NASTY)
    print_table([[NASTY]], [NASTY])
    print_rows({NASTY: NASTY}, title=NASTY)
    print_json({NASTY: [NASTY]})
    with reporting():
        logging.getLogger("glsk_o3d").warning("%s", NASTY)
    with pytest.raises(typer.Exit), reporting(verbose=True):
        raise FileFormatError(NASTY)
    out, err = capfd.readouterr()
    assert commands(out + err) == []
    assert out.count(r"\x1b[2J") == 6
    assert err.count(r"\x1b[2J") >= 4
    assert json.loads(out[out.index("{") :]) == {NASTY: [NASTY]}


@pytest.mark.parametrize(
    "words",
    [
        ["skeletonize", "s\x1b]0;t\x07.xyz", "-o", "k\x1b[31m.json", "--stream"],
        ["skeletonize", "s\x1b]0;t\x07.xyz", "--set", "k\x1b[31m=3"],
        ["info", "bad\x1b[2J.json"],
        ["info", "--where", "x\x1b[31m > 3", "s\x1b]0;t\x07.xyz"],
        ["run", "bad\x1b[2J.mlx", "s\x1b]0;t\x07.xyz", "-o", "o.ply"],
        ["filters", "no\x1b[31m"],
    ],
)
def test_nothing_of_a_file_or_its_name_reaches_the_terminal(invoke, tmp_path, monkeypatch, words):
    folder = tmp_path / "x\x1b[31m\x9b1m"
    folder.mkdir()
    np.savetxt(folder / "s\x1b]0;t\x07.xyz", torus(300).points)
    (folder / "bad\x1b[2J.json").write_text('{"format": "\\u001b[31m"}')
    (folder / "bad\x1b[2J.mlx").write_text('<FilterScript><filter name="&#155;x"/></FilterScript>')
    monkeypatch.chdir(folder)
    result = invoke(*words)
    assert commands(result.output) == []
    assert result.output.strip()


@pytest.mark.parametrize("number", ["9" * 5000, "-" + "9" * 401])
@pytest.mark.parametrize(
    "words",
    [
        ["skeletonize", "s.xyz", "--set", "RingBuilder.k={}"],
        ["skeletonize", "s.xyz", "--set", "Refiner.root={}"],
        ["demo", "-o", "out", "--points", "{}"],
        ["edit", "k.json", "-o", "o.json", "--smooth", "{}"],
        ["branches", "k.json", "--root", "{}"],
    ],
)
def test_numbers_too_long_for_any_are_said_in_a_sentence(invoke, number, words):
    np.savetxt("s.xyz", torus(300).points)
    line = np.arange(4)
    save_skeleton(
        Skeleton(np.eye(3)[np.zeros(4, int)] * line[:, None], [[0, 1], [1, 2], [2, 3]], line, [], [], []), "k.json"
    )
    result = invoke(*(word.format(number) for word in words))
    assert result.exit_code == 2, result.output
    assert "rror: " in result.output


def test_a_file_that_may_not_be_read_is_one_line(refused, tmp_path, monkeypatch):
    np.savetxt(tmp_path / "s.xyz", torus(300).points)
    monkeypatch.setattr("os.access", lambda *_, **__: False)

    def refuse(path, where):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("glsk_o3d.io.scans.read_scan", refuse)
    assert refused(1, "skeletonize", "s.xyz", "-o", "o.json") == "s.xyz: Permission denied"


def test_numbers_of_python_are_told_without_pages_of_digits():
    with pytest.raises(InvalidParameterError, match=r"RingBuilder\.k = a number of 5001 digits: must be at most 9\.2"):
        RingBuilder(k=10**5000).check()
    for number, digits in {10**401 - 1: 401, -(10**401) + 1: 401, 10**401: 402, 2**63: 19, 10**19 - 1: 19}.items():
        assert shown(number) == f"a number of {digits} digits"
    with pytest.raises(InvalidParameterError, match=r"around = a number of 401 digits: must be at most 1e\+100"):
        Thinner(around=10**400).check()
    with pytest.raises(InvalidParameterError, match=r"root = a tuple: must be"):
        Tracer(root=(10**5000, 0, 0)).check()
