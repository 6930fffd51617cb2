"""What a hostile file, name or number must not do: reach the terminal, end in a traceback, or spoil JSON."""

import numpy as np
import pytest

from glsk_o3d.samples import torus

NASTY = "a\x1b[2J\x1b]0;title\x07\x9b31m\rbc\x7f"


def commands(text):
    """Characters that a terminal would obey."""
    return [sign for sign in text if sign in NASTY and not sign.isprintable()]


@pytest.mark.parametrize(
    "words",
    [
        ["skeletonize", "s\x1b]0;t\x07.xyz", "-o", "k\x1b[31m.json"],
        ["info", "bad\x1b[2J.json"],
        ["info", "--where", "x\x1b[31m > 3", "s\x1b]0;t\x07.xyz"],
        ["run", "bad\x1b[2J.mlx", "s\x1b]0;t\x07.xyz", "-o", "o.ply"],
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
@pytest.mark.parametrize("words", ["skeletonize s.xyz -o o.json --set RingBuilder.k={}", "branches y.ply --root {}"])
def test_numbers_too_long_for_any_are_refused(invoke, y, number, words):
    np.savetxt("s.xyz", torus(300).points)
    result = invoke(*words.format(number).split())
    assert result.exit_code == 2, result.output
    assert "rror: " in result.output
