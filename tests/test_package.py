"""The package as a whole, and what is published: the page on PyPI, extras, notes of a release, imports."""

import re
import subprocess
import sys
from importlib.metadata import version

import tomlkit

import glsk_o3d


def pyproject(root):
    return tomlkit.parse((root / "pyproject.toml").read_text("utf-8")).unwrap()


def test_links_of_the_readme_lead_to_the_repository_on_pypi(root):
    readme, facts = (root / "README.md").read_text("utf-8"), pyproject(root)
    relative = re.findall(r"\]\((?!\w+:)([^)#]+)", readme)
    assert len(relative) > 20
    for rule in facts["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]["substitutions"]:
        readme = re.sub(rule["pattern"], rule["replacement"], readme)
    repository = facts["project"]["urls"]["Repository"]
    raw = repository.replace("https://github.com", "https://raw.githubusercontent.com")
    for target in relative:
        place = f"{raw}/v$HFPR_VERSION" if target.endswith(".png") else f"{repository}/blob/v$HFPR_VERSION"
        assert f"({place}/{target}" in readme
    assert not re.search(r"\]\((?!https://)", readme)


def test_metadata_agree_with_the_pages(root):
    project = pyproject(root)["project"]
    cited = re.search(r"^version: (.+)$", (root / "CITATION.cff").read_text(), re.MULTILINE)[1]
    assert glsk_o3d.__version__ == cited == version("glsk-o3d")
    pythons = [line.rpartition(" ")[2] for line in project["classifiers"] if " :: 3." in line]
    (tested,) = re.findall(r"python: \[(.*)\]", (root / ".github/workflows/ci.yml").read_text("utf-8"))
    assert [word.strip('" ') for word in tested.split(",")] == pythons
    assert project["requires-python"] == f">={pythons[0]}"
    assert f"Python {pythons[0]} to {pythons[-1]}" in (root / "README.md").read_text("utf-8")
    extras, (full,) = project["optional-dependencies"], project["optional-dependencies"]["full"]
    users = set(full[len("glsk-o3d[") : -1].split(","))
    rows = set(re.findall(r"^\| `(\w+)` \| .* \|$", (root / "docs/start.md").read_text("utf-8"), re.MULTILINE))
    assert rows >= users
    assert set(extras) == {*users, "full", "test", "lint", "docs", "dev"}
    assert all((root / name / "py.typed").is_file() for name in ("glsk_o3d", "benchmarks/src/glsk_bench"))


def test_release_notes_are_those_of_the_tag(root, tmp_path):
    script = root / "scripts" / "release_notes.py"
    for name in ("scripts", "glsk_o3d"):
        (tmp_path / name).mkdir()
    (tmp_path / "scripts" / script.name).write_text(script.read_text("utf-8"))
    (tmp_path / "glsk_o3d" / "__init__.py").write_text('__version__ = "0.2.0"\n')
    (tmp_path / "CITATION.cff").write_text("cff-version: 1.2.0\nversion: 0.2.0\n")
    for date, tag, code, output in (
        ("unreleased", "v0.2.0", 1, "CHANGELOG.md: needs a heading"),
        ("2026-02-01", "v0.2.0", 0, "- New.\n"),
        ("2026-02-01", "v0.3.0", 1, "the tag is v0.3.0"),
    ):
        changes = f"# Changelog\n\n## [0.2.0] - {date}\n\n- New.\n\n## [0.1.0] - 2026-01-01\n\nOld.\n"
        (tmp_path / "CHANGELOG.md").write_text(changes)
        run = subprocess.run([sys.executable, tmp_path / "scripts" / script.name, tag], capture_output=True, text=True)
        assert (run.returncode, output in run.stdout + run.stderr) == (code, True)


def test_import_leaves_the_heavy_packages_alone(root):
    code = "import sys, glsk_o3d; print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    run = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    heavy = {"open3d", "matplotlib", "networkx", "igl", "pymeshlab", "plotly", "typer", "rich"}
    assert heavy.isdisjoint(run.stdout.split())
    assert "glsk_o3d" in run.stdout.split()
