"""What a hostile file, name or number must not do: reach the terminal, end in a traceback, or spoil JSON."""

import ast
import json
import logging
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from glsk_o3d import Skeleton, cli
from glsk_o3d.cli.console import console, echo, print_json, print_rows, print_table, say, visible
from glsk_o3d.cli.main import app
from glsk_o3d.cli.reporting import reporting
from glsk_o3d.errors import FileFormatError
from glsk_o3d.parameters import shown
from glsk_o3d.samples import torus

NASTY = "a\x1b[2J\x1b]0;title\x07\x9b31m\rb\u202ec\x7f"
HARMLESS = r"a\x1b[2J\x1b]0;title\x07\x9b31m\rb\u202ec\x7f"


def commands(text):
    """Characters that a terminal would obey."""
    return [sign for sign in text if sign in NASTY and not sign.isprintable()]


def call(*words):
    result = CliRunner().invoke(app, [*map(str, words)])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def test_visible_text_says_what_was_there():
    assert visible(NASTY) == HARMLESS
    assert visible("Größe 3 µm\n\tü") == "Größe 3 µm\n\tü"
    assert visible(visible(NASTY)) == HARMLESS


def test_whatever_prints(capfd):
    from rich.table import Table

    table = Table(NASTY)
    table.add_row(NASTY)
    echo(NASTY)
    say("error", NASTY)
    console().print(NASTY)
    print_table(table)
    print_rows({NASTY: NASTY}, title=NASTY)
    with reporting():
        logging.getLogger("glsk_o3d").warning("%s", NASTY)
    with pytest.raises(typer.Exit), reporting(verbose=True):
        raise FileFormatError(NASTY)
    out, err = capfd.readouterr()
    assert commands(out + err) == []
    assert out.count(r"\x1b[2J") == 7
    assert err.count(r"\x1b[2J") >= 4


def test_json_stays_json(capfd):
    print_json({NASTY: [NASTY]})
    out = capfd.readouterr().out
    assert commands(out) == []
    assert json.loads(out) == {NASTY: [NASTY]}


@pytest.fixture
def nasty_folder(tmp_path):
    """A folder whose name and files hold what terminals obey."""
    folder = tmp_path / "x\x1b[31m\x9b1m"
    folder.mkdir()
    np.savetxt(folder / "s\x1b]0;t\x07.xyz", torus(300).points)
    (folder / "bad\x1b[2J.json").write_text('{"format": "\\u001b[31m"}')
    (folder / "bad\x1b[2J.mlx").write_text('<FilterScript><filter name="&#155;x"/></FilterScript>')
    (folder / "r.toml").write_text('[[stages]]\nfilter = "Ring\\u001b[31m"\n')
    return folder


@pytest.mark.parametrize(
    "words",
    [
        ["skeletonize", "s\x1b]0;t\x07.xyz", "-o", "k\x1b[31m.json"],
        ["skeletonize", "no\x1b[31m.xyz", "-o", "k.json"],
        ["skeletonize", "s\x1b]0;t\x07.xyz", "-o", "k.json", "--stream"],
        ["skeletonize", "s\x1b]0;t\x07.xyz", "-o", "k.json", "--recipe", "r.toml"],
        ["skeletonize", "s\x1b]0;t\x07.xyz", "--set", "k\x1b[31m=3"],
        ["info", "bad\x1b[2J.json"],
        ["info", "s\x1b]0;t\x07.xyz"],
        ["info", "--where", "x\x1b[31m > 3", "s\x1b]0;t\x07.xyz"],
        ["run", "bad\x1b[2J.mlx", "s\x1b]0;t\x07.xyz", "-o", "o.ply"],
        ["batch", ".", "-o", "../out\x1b[31m", "--dry-run"],
        ["filters", "no\x1b[31m"],
        ["no\x1b[31m"],
        ["skeletonize", "--no\x1b[31m"],
        ["edit", "bad\x1b[2J.json", "-o", "o.json", "--smooth", "\x1b[31m"],
    ],
)
def test_nothing_of_it_reaches_the_terminal(nasty_folder, monkeypatch, words):
    monkeypatch.chdir(nasty_folder)
    result = call(*words)
    assert commands(result.output) == []
    assert result.output.strip()


def test_all_that_is_printed_goes_through_the_console():
    bare = ("typer.echo", "typer.secho", "click.echo", "print", "sys.stdout.write", "sys.stderr.write")
    found = [
        f"{path.name}:{node.lineno}"
        for path in Path(cli.__file__).parent.glob("*.py")
        if path.name != "console.py"
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and ast.unparse(node.func) in bare
    ]
    assert found == []


@pytest.mark.parametrize("number", ["9" * 401, "9" * 5000, "-" + "9" * 401])
@pytest.mark.parametrize(
    "words",
    [
        ["skeletonize", "s.xyz", "--set", "RingBuilder.k={}"],
        ["skeletonize", "s.xyz", "--set", "Contractor.max_iterations={}"],
        ["skeletonize", "s.xyz", "--set", "Refiner.root={}"],
        ["demo", "-o", "out", "--points", "{}"],
        ["edit", "k.json", "-o", "o.json", "--smooth", "{}"],
        ["edit", "k.json", "-o", "o.json", "--root", "{}"],
        ["branches", "k.json", "--root", "{}"],
    ],
)
def test_numbers_too_long_for_any_are_said_in_a_sentence(tmp_path, monkeypatch, number, words):
    monkeypatch.chdir(tmp_path)
    np.savetxt("s.xyz", torus(300).points)
    line = np.arange(4)
    Skeleton(np.eye(3)[np.zeros(4, int)] * line[:, None], [[0, 1], [1, 2], [2, 3]], line, [], [], []).save("k.json")
    result = call(*(word.format(number) for word in words))
    assert result.exit_code == 2, result.output
    assert "rror: " in result.output


def test_numbers_of_python_are_told_without_pages_of_digits():
    from glsk_o3d import InvalidParameterError, RingBuilder

    with pytest.raises(InvalidParameterError, match=r"RingBuilder\.k = a number of 5001 digits: must be at most 9\.2"):
        RingBuilder(k=10**5000).check()
    for number, digits in {10**401 - 1: 401, -(10**401) + 1: 401, 10**401: 402, 2**63: 19, 10**19 - 1: 19}.items():
        assert shown(number) == f"a number of {digits} digits"
    with pytest.raises(InvalidParameterError, match=r"around = a number of 401 digits: must be at most 1\.79769e\+308"):
        RingBuilder(around=10**400).check()
    RingBuilder(thin_to=2**63 - 1).check()


def test_a_file_that_may_not_be_read_is_one_line(tmp_path, monkeypatch):
    np.savetxt(tmp_path / "s.xyz", torus(300).points)
    monkeypatch.setattr("os.access", lambda *_, **__: False)
    result = call("skeletonize", tmp_path / "s.xyz", "-o", tmp_path / "o.json")
    assert result.exit_code == 1
    lines = result.output.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("glsk: error: ")
    assert lines[0].endswith("is not readable")


def test_what_a_plugin_prints_is_no_result(install, capfd):
    install("glsk-loud", "1.0", "print('hello')\nfrom glsk_o3d import pipelines\nmake = pipelines.default\n",
            "[glsk_o3d.pipelines]\nloud = glsk_loud:make\n")  # fmt: skip
    result = CliRunner().invoke(app, ["filters", "--json"])
    assert "loud" in [made["name"] for made in json.loads(result.stdout)["pipelines"]]
    assert "hello" in result.stderr


def test_mistakes_that_typer_finds_are_told_with_visible_words(capfd):
    """Whatever its version makes of them itself."""
    from glsk_o3d.cli.console import VisibleGroup

    class Mistaken(VisibleGroup):
        def parse_args(self, *_):
            error = RuntimeError("a mistake")
            error.message = NASTY
            raise error

    with pytest.raises(RuntimeError) as raised:
        Mistaken(name="glsk").make_context("glsk", [])
    assert raised.value.message == HARMLESS
