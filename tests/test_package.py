"""The package as a whole, and what is published: the page on PyPI, extras, workflows, notes of a release."""

import re
import subprocess
import sys
from importlib.metadata import version

import pytest
import tomlkit

import glsk_o3d


@pytest.fixture
def pyproject(root):
    return tomlkit.parse((root / "pyproject.toml").read_text("utf-8")).unwrap()


def test_links_of_the_readme_lead_to_the_repository_on_pypi(root, pyproject):
    readme = (root / "README.md").read_text("utf-8")
    relative = re.findall(r"\]\((?!\w+:)([^)#]+)", readme)
    assert len(relative) > 20
    assert all((root / target).exists() for target in relative)
    for rule in pyproject["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]["substitutions"]:
        readme = re.sub(rule["pattern"], rule["replacement"], readme)
    pages, pictures = "https://github.com/", "https://raw.githubusercontent.com/"
    home = "glsk-o3d/glsk-o3d"
    assert pyproject["project"]["urls"]["Repository"] == pages + home
    links = re.findall(r"(!?)\[[^]]*\]\(([^)]+)\)", readme)
    assert all(target.startswith("https://") for _, target in links)
    assert [target for mark, target in links if mark] == [
        f"{pictures}{home}/v$HFPR_VERSION/{target}" for target in relative if target.endswith(".png")
    ]
    for target in relative:
        assert target.endswith(".png") or f"({pages}{home}/blob/v$HFPR_VERSION/{target}" in readme


def test_every_extra_for_users_is_where_one_installs(root, pyproject):
    start = (root / "docs" / "start.md").read_text("utf-8")
    extras = pyproject["project"]["optional-dependencies"]
    (full,) = extras["full"]
    users = set(full[len("glsk-o3d[") : -1].split(","))
    assert set(re.findall(r"^\| `(\w+)` \| .* \|$", start, re.MULTILINE)) >= users
    assert set(extras) == {*users, "full", "test", "lint", "docs", "dev"}


def test_pythons_are_the_same_everywhere(root, pyproject):
    named = [line.rpartition(" ")[2] for line in pyproject["project"]["classifiers"] if " :: 3." in line]
    (tested,) = re.findall(r"python: \[(.*)\]", (root / ".github/workflows/ci.yml").read_text("utf-8"))
    assert [word.strip('" ') for word in tested.split(",")] == named
    assert pyproject["project"]["requires-python"] == f">={named[0]}"
    assert f"Python {named[0]} to {named[-1]}" in (root / "README.md").read_text("utf-8")


def test_release_notes(root, tmp_path):
    for name in ("scripts", "glsk_o3d"):
        (tmp_path / name).mkdir()
    script, changes = tmp_path / "scripts" / "release_notes.py", tmp_path / "CHANGELOG.md"
    script.write_text((root / "scripts" / "release_notes.py").read_text("utf-8"))
    (tmp_path / "glsk_o3d" / "__init__.py").write_text('__version__ = "0.2.0"\n')
    (tmp_path / "CITATION.cff").write_text("cff-version: 1.2.0\nversion: 0.2.0\n")
    for date, tag, said in (
        ("unreleased", "v0.2.0", "CHANGELOG.md: needs a heading"),
        ("2026-02-01", "v0.2.0", "- New.\n"),
        ("2026-02-01", "v0.3.0", "the tag is v0.3.0"),
    ):
        changes.write_text(f"# Changelog\n\n## [0.2.0] - {date}\n\n- New.\n\n## [0.1.0] - 2026-01-01\n\nOld.\n")
        done = subprocess.run([sys.executable, str(script), tag], capture_output=True, text=True)
        assert said in (done.stderr if done.returncode else done.stdout)
        assert (done.returncode == 0) == said.startswith("-")


def test_import_leaves_the_heavy_packages_alone(root):
    code = "import sys, glsk_o3d; print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    run = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    loaded = set(run.stdout.split())
    assert "glsk_o3d" in loaded
    assert not loaded & {"open3d", "matplotlib", "networkx", "igl", "pymeshlab", "plotly", "typer", "rich"}


def test_there_is_one_version(root):
    cited = re.search(r"^version: (.+)$", (root / "CITATION.cff").read_text(), re.MULTILINE)[1]
    assert glsk_o3d.__version__ == cited == version("glsk-o3d")


def test_is_typed(root):
    for package in ("glsk_o3d", "benchmarks/src/glsk_bench"):
        assert (root / package / "py.typed").is_file()
