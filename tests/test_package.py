"""The package as a whole: its page on PyPI, metadata, notes of a release, imports, and types."""

import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
import tomlkit

import glsk_o3d

PYPROJECT = tomlkit.parse((Path(__file__).resolve().parents[1] / "pyproject.toml").read_text("utf-8"))


def test_links_of_the_readme_lead_to_the_repository(root):
    readme = (root / "README.md").read_text("utf-8")
    relative = re.findall(r"\]\((?!\w+:)([^)#]+)", readme)
    assert len(relative) > 20
    for rule in PYPROJECT["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]["substitutions"]:
        readme = re.sub(rule["pattern"], rule["replacement"], readme)
    repository = PYPROJECT["project"]["urls"]["Repository"]
    raw = repository.replace("https://github.com", "https://raw.githubusercontent.com")
    for target in relative:
        place = f"{raw}/v$HFPR_VERSION" if target.endswith(".png") else f"{repository}/blob/v$HFPR_VERSION"
        assert f"({place}/{target}" in readme
    assert not re.search(r"\]\((?!https://)", readme)


def test_metadata_agree_with_the_pages(root):
    project = PYPROJECT["project"]
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
    script = tmp_path / "scripts" / "release_notes.py"
    for path in (script, tmp_path / "glsk_o3d" / "__init__.py"):
        path.parent.mkdir()
        path.write_text((root / path.relative_to(tmp_path)).read_text("utf-8"))
    (tmp_path / "CITATION.cff").write_text((root / "CITATION.cff").read_text("utf-8"))
    number = glsk_o3d.__version__
    for date, tag, output in (
        ("unreleased", f"v{number}", "CHANGELOG.md: needs a heading"),
        ("2026-02-01", f"v{number}", "- New.\n"),
        ("2026-02-01", "v9.0.0", "the tag is v9.0.0"),
    ):
        changes = f"# Changelog\n\n## [{number}] - {date}\n\n- New.\n\n## [0.0.1] - 2026-01-01\n\nOld.\n"
        (tmp_path / "CHANGELOG.md").write_text(changes)
        run = subprocess.run([sys.executable, script, tag], capture_output=True, text=True)
        assert output in (run.stderr if run.returncode else run.stdout)


def test_an_import_leaves_the_heavy_packages_alone(root):
    code = "import sys, glsk_o3d; print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    run = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    heavy = {"open3d", "matplotlib", "networkx", "igl", "pymeshlab", "plotly", "typer", "rich"}
    assert {*run.stdout.split()} & {"glsk_o3d", *heavy} == {"glsk_o3d"}


SCRIPT = """\
import numpy as np
import open3d as o3d

import glsk_o3d as glsk
from glsk_o3d import Cloud, Connector, Contraction, Contractor, LPRReducer, Pipeline, Points, Refiner, RingBuilder
from glsk_o3d import Sampler, Skeleton, Tracer, pipelines
from glsk_o3d.filters.stopping import ExplainedScore

cloud = glsk.read_cloud("scan.ply")
skeleton: Skeleton = glsk.skeletonize(cloud, {"RingBuilder.k": 24}, on_iteration=lambda record: record.n_points > 100)
skeleton = glsk.skeletonize(np.zeros((10, 3)), "wen2024", k="auto", reducer=None, root=(0, 0, 1), drop_invalid=True)
start: Pipeline[Points, Contraction] = RingBuilder() | Contractor(reducer=LPRReducer(), stop=ExplainedScore(0.02))
state: Contraction = start(cloud)
whole: Pipeline[Points, Skeleton] = start | Connector(radius="2%", links="all") | Refiner()
prepared: Pipeline[Cloud, Skeleton] = Sampler() | (whole | Tracer())
skeleton = whole(cloud, on_stage=lambda stage: print(stage.kind))
glsk.save_skeleton(skeleton, "tree.swc", cut_loops=True)
o3d.visualization.draw_geometries([cloud, skeleton.to_line_set(), glsk.to_tubes(skeleton, (0, 0, 1), sides=8)])
again: Skeleton = glsk.load_recipe("plant.json")(cloud)

Contractor(reducer="LPRReducer")  # wrong
Connector(links="al")  # wrong
glsk.save_skeleton(skeleton, "x.swc", cut_lops=True)  # wrong
glsk.skeletonise(cloud)  # wrong
glsk.skeletonize(cloud, on_iteration=lambda record: record.n_point > 100)  # wrong
pipelines.default()(cloud).n_loop  # wrong
(RingBuilder() | Contractor())(cloud).vertices  # wrong
RingBuilder() | Refiner()  # wrong
start | Tracer()  # wrong
skeletons: Pipeline[Points, Contraction] = whole  # wrong
"""


@pytest.mark.slow
def test_types_of_the_public_names_catch_all_mistakes(tmp_path, root):
    pytest.importorskip("mypy")
    script, config = tmp_path / "script.py", tmp_path / "mypy.ini"
    script.write_text(SCRIPT)
    config.write_text(
        f"[mypy]\nmypy_path = {root}\nfollow_imports = silent\n"
        "[mypy-igl.*,matplotlib.*,networkx.*,PIL.*,rich.*,scipy.*,typer.*]\nfollow_imports = skip\n"  # for speed alone
    )
    words = [sys.executable, "-m", "mypy", "--config-file", config, "--cache-dir", tmp_path / "cache", script]
    run = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    wrong = {number for number, line in enumerate(SCRIPT.splitlines(), 1) if line.endswith("# wrong")}
    assert {int(line) for line in re.findall(r"^script\.py:(\d+): error", run.stdout, re.MULTILINE)} == wrong, (
        run.stdout
    )
