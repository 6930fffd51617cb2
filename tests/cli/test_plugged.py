"""Commands of other distributions."""

from importlib.metadata import EntryPoint

import pytest
import typer
from typer.testing import CliRunner

from glsk_o3d.cli import main


@pytest.fixture
def glsk(monkeypatch):
    """Runs a command line of an application with one command of its own and those of some entry points."""

    def run(words, **values):
        group = main.COMMAND_GROUP
        found = [("some 1", EntryPoint(name, value, group)) for name, value in values.items()]
        monkeypatch.setattr(main, "entry_points", lambda group, problems: found)
        return with_plugged(words)

    return run


def with_plugged(words):
    app = typer.Typer()
    app.command("own")(lambda: None)
    main.add_plugged(app)
    return CliRunner().invoke(app, words)


def test_what_is_installed_is_a_command(glsk):
    shown = glsk(["benchmark", "--help"], benchmark="glsk_bench.command:app")
    assert shown.exit_code == 0
    assert {"make", "run", "score", "table"} <= set(shown.stdout.split())


@pytest.mark.parametrize("more", [[], ["make", "bench", "--jobs", "2"], ["--help"]])
def test_what_is_not_says_how_to_get_it(glsk, more):
    absent = glsk(["benchmark", *more])
    assert absent.exit_code == 1
    assert absent.stdout == ""
    cure = "pip install ./benchmarks in a clone of glsk-o3d"  # it is not on PyPI
    assert absent.stderr == f"glsk: error: glsk benchmark needs another distribution: {cure}\n"


@pytest.mark.parametrize("value", ["no_such_module:app", "json:dumps", "json:__name__"])
def test_what_is_broken_or_no_application_is_left_out(glsk, capsys, value):
    result = glsk(["own"], broken=value)
    assert result.exit_code == 0
    warning = capsys.readouterr().err
    assert warning.count("\n") == 1
    assert warning.startswith(f"glsk: warning: the command 'broken' ({value}) is left out: ")


@pytest.mark.parametrize("entries", ["[glsk_o3d.commands\nx = json:dumps\n", "[ glsk_o3d.commands ]\nx = json:dumps\n"])
def test_a_malformed_file_of_another_distribution_stops_no_command(install, capsys, entries):
    install("glsk-odd", "1", "", entries)
    assert with_plugged(["own"]).exit_code == 0
    warning = capsys.readouterr().err
    assert warning.count("\n") == 1
    assert warning.startswith("glsk: warning: the plugins of glsk-odd left out: its entry_points.txt is malformed: ")
