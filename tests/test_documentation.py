"""The pages: every code block runs, every public name is documented, every equation has its number."""

import contextlib
import dataclasses
import importlib
import inspect
import io
import re
import shlex
import shutil
import sys
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
import tomlkit
from typer.testing import CliRunner

import glsk_o3d as glsk
from glsk_o3d import samples, save_skeleton
from glsk_o3d.cli.main import app
from glsk_o3d.cli.overrides import override
from glsk_o3d.recipes.catalogue import BUILTIN

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs" / "_ext"))
api, figures = (importlib.import_module(name) for name in ("api", "figures"))
sys.path.pop(0)

PAGES = [
    path
    for path in (
        *ROOT.glob("*.md"),
        *ROOT.glob("docs/**/*.md"),
        ROOT / "benchmarks/README.md",
        ROOT / "filters/README.md",
    )
    if "generated" not in path.parts
]
FENCE = re.compile(r"^( *)```(\S*)[^\n]*\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
PICTURE = re.compile(r"!\[(.*?)\]\((.*?)\)")


def blocks(path, *languages):
    """The code blocks of a page in these languages."""
    return [body for _, language, body in FENCE.findall(path.read_text()) if language in languages]


def pages(*languages):
    """The pages that have such blocks."""
    return [pytest.param(path, id=str(path.relative_to(ROOT))) for path in PAGES if blocks(path, *languages)]


# ------------------------------------------------------------------------------------------------------- blocks of code


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """A folder with the files that the pages speak of."""
    folder = tmp_path_factory.mktemp("prepared")
    shape = samples.y_junction(1000)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(shape.points))
    for name in ("demo/cloud.ply", "scan.ply", "horse.ply", "next.ply", "other.ply", "scans/a/left.pcd", "scans/b.ply"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        assert o3d.io.write_point_cloud(str(folder / name), cloud)
    (folder / "list.txt").write_text("scan.ply\n")
    trees = np.concatenate([np.column_stack([shape.points + [0, 3 * i, 0], np.full(1000, i)]) for i in (17, 18)])
    np.savetxt(folder / "plot.csv", trees, delimiter=",", header="x,y,z,treeID", comments="")
    np.savez(folder / "axis.npz", nodes=shape.nodes, edges=shape.edges, radii=shape.radii)
    cloud.estimate_normals()
    cloud.orient_normals_consistent_tangent_plane(10)
    balls = o3d.utility.DoubleVector([0.05, 0.1, 0.2])
    mesh = o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, balls)
    assert o3d.io.write_triangle_mesh(str(folder / "scan_mesh.ply"), mesh)
    skeleton = glsk.skeletonize(cloud)
    for name in ("skeleton.ply", "skeleton.json", "s.json", "horse.json"):
        save_skeleton(skeleton, folder / name)
    glsk.save_recipe(glsk.pipelines.default(), folder / "plant.json")
    (folder / "mine.mlx").write_text((ROOT / "filters" / "glskeleton.mlx").read_text())
    return folder


@pytest.fixture
def workplace(prepared, tmp_path, monkeypatch):
    """A copy of it to work in, without a screen."""
    shutil.copytree(prepared, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setattr(o3d.visualization, "draw_geometries", lambda shapes: None)
    monkeypatch.setattr("glsk_o3d.viewing.window.show", lambda *arguments, **options: None)


def run_python(code, names, page):
    """Run a block; what it prints after ``# prints`` must be so."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile(code, page, "exec"), names)
    promised = "".join(f"{line}\n" for line in re.findall(r"# prints (.*)", code))
    assert not promised or said.getvalue() == promised


def run_shell(code):
    """Run the lines for ``glsk``; of others see that what they name is there."""
    for line in code.replace("\\\n", " ").splitlines():
        words = shlex.split(re.sub(r"[][]", "", line), comments=True)  # brackets: what may be left out
        if words and words[0] == "glsk":
            dry = ["--dry-run"] if "--scheduler" in words else []  # there is none
            words = [word.replace("FILE", "scan.ply") for word in words[1:]] + dry
            result = CliRunner().invoke(app, words)
            assert result.exit_code == 0, f"glsk {shlex.join(words)}\n{result.output}\n{result.exception!r}"
        elif words:
            check_command(words)


def check_command(words):
    program, *rest = words
    if program == "make":
        assert f"\n{rest[0]}: " in (ROOT / "Makefile").read_text()
    elif "pip" in words:
        for extras in re.findall(r"(?:\.|glsk-o3d)\[([\w,]+)\]", " ".join(rest)):
            assert set(extras.split(",")) <= set(PROJECT["optional-dependencies"])
    elif program.endswith("python") and rest[0].startswith("benchmarks/"):
        places = (ROOT / rest[0], *(ROOT / "benchmarks").glob("_*.py"))
        code = "".join(place.read_text() for place in places)
        assert all(f'"{word}"' in code for word in rest if word.startswith("--"))
    else:
        assert program in ("python3", "source", "dask")


PROJECT = tomlkit.parse((ROOT / "pyproject.toml").read_text())["project"]


@pytest.mark.slow
@pytest.mark.parametrize("path", pages("python", "sh", "bash"))
@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")  # the clouds are small
def test_every_block_runs(path, workplace, install):
    page = str(path.relative_to(ROOT))
    if page == "docs/plugins.md":
        (code,), (entries,) = blocks(path, "python"), blocks(path, "toml")
        groups = tomlkit.parse(entries).unwrap()["project"]["entry-points"]
        install(
            "glsk-slab", "0.1", code, "".join(f"[{g}]\n{n} = {v}\n" for g, e in groups.items() for n, v in e.items())
        )
    cloud = glsk.read_cloud("scan.ply")
    names = dict(__name__="__main__", glsk=glsk, o3d=o3d, np=np, cloud=cloud, points=np.asarray(cloud.points))
    names |= dict(skeleton=glsk.read_skeleton("skeleton.json"))
    for _, language, body in FENCE.findall(path.read_text()):
        if language == "python":
            run_python(body, names, page)
        elif language in ("sh", "bash"):
            run_shell(body)


# --------------------------------------------------------------------------------------------------------- public names

UNTRIED = ("known_pipelines", "named_pipeline", "signed_distance")  # for those who extend the package


@pytest.mark.parametrize("package", api.PACKAGES)
def test_every_public_name_has_its_task(package):
    beside = ["MeshSet"] if package == "glsk_o3d" else []  # not in __all__, since it needs an extra
    assert sorted(api.names(package)) == sorted([*api.found(package), *beside])
    assert list(api.NAMES) == list(api.TASKS)


NAMES = [(module, name) for module in (*api.PACKAGES, *api.MODULES) for name in api.names(module)]


RETURNED = {  # what a function returns is tried in the example of that function
    result
    for module, name in NAMES
    for result in re.findall(r"Returns\n-+\n(\w+)", inspect.getdoc(getattr(importlib.import_module(module), name)))
}


@pytest.mark.parametrize(("module", "name"), NAMES, ids=lambda word: word.removeprefix("glsk_o3d"))
def test_every_public_name_is_documented(module, name):
    thing = getattr(importlib.import_module(module), name)
    told = inspect.getdoc(thing)
    assert told
    assert ".. math::" not in told  # has no number
    if module in api.PACKAGES and name not in (*UNTRIED, *RETURNED):
        assert ">>>" in told or issubclass(thing, Exception)
    if not inspect.isclass(thing):
        heads = re.findall(r"^([\w*, ]+?)(?: : .*)?$", told.partition("Parameters\n---")[2], re.MULTILINE)
        named = {name.strip("* ") for head in heads for name in head.split(",")}
        assert set(inspect.signature(thing).parameters) <= named
        return
    for member, value in vars(thing).items():
        if not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property | classmethod)):
            assert inspect.getdoc(getattr(thing, member)), member


def test_the_advice_on_parameters_can_be_taken():
    settings = re.findall(r"`(\w+\.\w+=[^`]+)`", (ROOT / "docs" / "parameters.md").read_text())
    assert len(settings) > 15
    for setting in settings:
        assert override(glsk.pipelines.default(), [setting]) != glsk.pipelines.default()


def cells(page):
    """The cells of all lines of tables of a page."""
    text = (ROOT / "docs" / page).read_text()
    return [re.split(r"(?<!\\) \| ", line[2:-2]) for line in text.splitlines() if line.startswith("| ")]


def test_the_effects_of_settings_are_those_of_the_ablation():
    of_all = {row[-1]: row[-2] for row in cells("accuracy.md") if len(row) == 11 and row[0].startswith("without")}
    (whole,) = [row[-2] for row in cells("accuracy.md") if len(row) == 11 and row[0] == "default"]
    said = re.findall(r"(`[^`]+`): ([\d.]+ / \d+) → ([\d.]+ / \d+); \w+:", (ROOT / "docs/differences.md").read_text())
    assert {setting: without for setting, _, without in said} == of_all
    assert {default for _, default, _ in said} == {whole}


def test_the_first_page_claims_what_the_pages_that_it_links_to_have_measured():
    text = (ROOT / "docs" / "index.md").read_text()
    claims = text.partition("## What it is better at")[2].partition("\n## ")[0].split("\n- ")[1:]
    assert len(claims) > 3
    for claim in claims:
        linked = re.findall(r"\]\((\w+\.md)", claim)
        assert linked, claim
        measured = re.findall(r"\d+\.\d+", "".join((ROOT / "docs" / page).read_text() for page in linked))
        assert set(re.findall(r"\d+\.\d+", claim)) <= set(measured), claim


def test_names_in_coming_from_are_parameters():
    calls = re.findall(rf"\b({'|'.join(BUILTIN)})\(([^()]+)\)", (ROOT / "docs" / "coming_from.md").read_text())
    assert len(calls) > 20
    for cls, words in calls:
        assert {*re.findall(r"(\w+)=", words)} <= {field.name for field in dataclasses.fields(BUILTIN[cls])}


def test_every_work_is_cited_and_every_citation_is_in_the_bibliography():
    works = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "docs" / "references.bib").read_text(), re.MULTILINE))
    cited = {name for path in PAGES for name in re.findall(r"\{cite:\w+\}`(\w+)`", path.read_text())}
    assert cited == works


def test_every_filter_has_a_page_with_all_its_sections():
    told = "".join(path.read_text() for path in ROOT.glob("docs/filters/*.md"))
    for cls in BUILTIN.values():
        assert f"```{{options}} {cls.__name__}\n" in told
    for path in set(ROOT.glob("docs/filters/*.md")) - {ROOT / "docs/filters/index.md"}:
        for section in ("What ", "Equations", "Example", "Options", "Cost", "Limits", "Source"):
            assert f"\n## {section}" in path.read_text(), path


@pytest.mark.parametrize("cls", BUILTIN.values(), ids=lambda cls: cls.__name__)
def test_every_option_leads_to_its_page(cls):
    (page,) = re.findall(r"docs/filters/\w+\.md", inspect.getdoc(cls))  # also what the page of the API shows
    assert page in CliRunner().invoke(app, ["filters", cls.__name__]).output
    (notes,) = re.findall(rf"```{{options}} {cls.__name__}\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)
    assert re.findall(r"^(\w+): .", notes, re.MULTILINE) == [field.name for field in dataclasses.fields(cls)]


# --------------------------------------------------------------------------------------------------- equations, links


def test_every_equation_has_a_number_of_its_own():
    numbers = []
    for path in PAGES:
        text = FENCE.sub("", path.read_text())
        for equation in re.findall(r"\$\$(.*?)\$\$", text, re.DOTALL):
            (number,) = re.findall(r"\\tag\{([^}]+)\}", equation)
            numbers.append(number)
    assert len(numbers) > 15
    assert len(set(numbers)) == len(numbers)


def test_every_picture_is_there_has_words_and_is_shown():
    shown = [(path, *each) for path in PAGES for each in PICTURE.findall(FENCE.sub("", path.read_text()))]
    for path, words, target in shown:
        assert words, (path, target)
        assert (path.parent / target).is_file(), (path, target)
        assert "generated" not in target  # of no use to who has not built the site
    targets = {Path(target).name for _, _, target in shown}
    assert {f"{draw.__name__}.png" for draw in figures.FIGURES} <= targets


@pytest.mark.slow
def test_the_first_picture_is_as_right_as_the_readme_says():
    found = [figures.skeletonised(points) for _, _, points, _ in figures.damaged()]
    counts = [(skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)) for skeleton in found]
    assert counts == [(1, 1, 6), (1, 0, 2), (1, 0, 9), (2, 2, 0), (1, 1, 0)]


def test_the_site_loads_nothing_from_elsewhere():
    """Sphinx checks where its links lead: warnings are errors."""
    site = ROOT / "build" / "docs"
    if not (site / "docs" / "index.html").exists():
        pytest.skip("needs the site: make docs")
    for path in site.rglob("*.html"):
        text = path.read_text("utf-8")
        assert not re.search(r'\bsrc="https?:', text), path
        assert not re.search(r'<link [^>]*rel="stylesheet"[^>]*href="https?:', text), path
