"""`glsk filters` says all that the code knows about itself; commands of other distributions."""

import dataclasses
import json
from importlib.metadata import EntryPoint

import pytest
import typer
from typer.testing import CliRunner

from glsk_o3d.cli import main
from glsk_o3d.pipeline import Filter
from glsk_o3d.pipelines import PIPELINES
from glsk_o3d.recipes.catalogue import catalogue


def test_every_parameter_and_every_pipeline_is_listed(invoke, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    text = invoke("filters").stdout
    assert max(map(len, text.splitlines())) <= 80
    text, facts = " ".join(text.split()), json.loads(invoke("filters", "--json").stdout)
    assert [item["name"] for item in facts["filters"]] == list(catalogue())
    for item in facts["filters"]:
        cls = catalogue()[item["name"]]
        alone = " ".join(invoke("filters", cls.__name__).stdout.split())
        assert item["kind"] == ("filter" if issubclass(cls, Filter) else "stopping rule")
        for parameter, field in zip(item["parameters"], dataclasses.fields(cls), strict=True):
            plain = repr(field.default) if dataclasses.is_dataclass(field.default) else field.default
            assert (parameter["name"], parameter["default"]) == (field.name, plain)
            assert all(parameter[key] == value for key, value in field.metadata.items() if key != "choices")
            for words in (f"{field.name} {field.metadata['doc']}", f"default {'none' if plain is None else plain}"):
                assert words in text
                assert words in alone
    expressions = {item["name"]: item["expression"] for item in facts["pipelines"]}
    assert expressions == {name: repr(make()) for name, make in PIPELINES.items()}
    assert all(expression in text for expression in expressions.values())


def test_what_a_plugin_prints_is_no_result(install, capfd):
    code = "print('hello')\nfrom glsk_o3d import pipelines\nmake = pipelines.default\n"
    install("glsk-loud", "1.0", code, "[glsk_o3d.pipelines]\nloud = glsk_loud:make\n")
    result = CliRunner().invoke(main.app, ["filters", "--json"])
    assert "loud" in [created["name"] for created in json.loads(result.stdout)["pipelines"]]
    assert "hello" in result.stderr


# ------------------------------------------------------------------------------------- commands of other distributions


@pytest.fixture
def glsk(monkeypatch):
    """Run a command line of an application with one command of its own and those of some entry points."""

    def run(*words, entries=None):
        if entries is not None:
            actual = [EntryPoint(name, value, main.COMMAND_GROUP) for name, value in entries.items()]
            monkeypatch.setattr(main, "entry_points", lambda group, problems: actual)
        app = typer.Typer()
        app.command("own")(lambda: None)
        main.add_plugged(app)
        return CliRunner().invoke(app, words)

    return run


def test_what_is_installed_is_a_command(glsk):
    shown = glsk("benchmark", "--help", entries={"benchmark": "glsk_bench.command:app"})
    assert shown.exit_code == 0
    assert {"make", "run", "score", "table"} <= set(shown.stdout.split())


@pytest.mark.parametrize("more", [["make", "bench", "--jobs", "2"], ["--help"]])
def test_what_is_not_says_how_to_get_it(glsk, more):
    absent = glsk("benchmark", *more, entries={})
    assert (absent.exit_code, absent.stdout) == (1, "")
    assert "needs another distribution: pip install ./benchmarks" in absent.stderr  # it is not on PyPI


@pytest.mark.parametrize("value", ["no_such_module:app", "json:__name__"])
def test_what_is_broken_or_no_application_is_left_out(glsk, capsys, value):
    assert glsk("own", entries={"broken": value}).exit_code == 0
    warning = capsys.readouterr().err
    assert warning.count("\n") == 1
    assert warning.startswith(f"glsk: warning: the command 'broken' ({value}) is left out: ")
