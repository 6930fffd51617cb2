"""The pages: every block of code runs, every link leads somewhere, every public name, option and equation is there."""

import ast
import contextlib
import dataclasses
import importlib
import inspect
import io
import itertools
import re
import runpy
import shlex
import shutil
import sys
from pathlib import Path
from types import FunctionType

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d
import pytest
import tomlkit
from typer.testing import CliRunner

import glsk_o3d as glsk
from glsk_o3d import samples
from glsk_o3d.cli.main import app
from glsk_o3d.cli.overrides import override
from glsk_o3d.recipes.catalogue import BUILTIN

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs" / "_ext"))
api, figures = (importlib.import_module(name) for name in ("api", "figures"))
sys.path.pop(0)
FENCE = re.compile(r"^( *)```(\S*)[^\n]*\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
READMES = [ROOT / "benchmarks" / "README.md", ROOT / "filters" / "README.md"]
PAGES = [path for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *READMES) if "generated" not in path.parts]
TEXT = {path: path.read_text("utf-8") for path in PAGES}
PROSE = {path: FENCE.sub("", text) for path, text in TEXT.items()}


def page(name):
    return TEXT[ROOT / "docs" / name]


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """A folder with the files that the pages name."""
    folder, shape = tmp_path_factory.mktemp("prepared"), samples.y_junction(1000)
    (folder / "scans" / "a").mkdir(parents=True)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(shape.points))
    assert all(
        o3d.io.write_point_cloud(str(folder / f), cloud) for f in ("scan.ply", "scans/a/left.pcd", "scans/b.ply")
    )
    trees = np.concatenate([np.column_stack([shape.points + [0, 3 * i, 0], np.full(1000, i)]) for i in (17, 18)])
    np.savetxt(folder / "plot.csv", trees, delimiter=",", header="x,y,z,treeID", comments="")
    np.savez(folder / "axis.npz", nodes=shape.nodes, edges=shape.edges, radii=shape.radii)
    results = " ".join(f"-o {folder / name}" for name in ("skeleton.ply", "skeleton.json", "plant.json"))
    run_shell(f"glsk skeletonize {folder / 'scan.ply'} {results} --tubes {folder / 'scan_mesh.ply'}")
    (folder / "list.txt").write_text("scan.ply\n")
    shutil.copy(ROOT / "filters" / "glskeleton.mlx", folder / "mine.mlx")
    return folder


def run_python(code, names):
    """Run a block and compare its output with the lines ``# prints``."""
    with contextlib.redirect_stdout(io.StringIO()) as output:
        exec(code, names)
    expected = "".join(f"{line}\n" for line in re.findall(r"# prints (.*)", code))
    assert not expected or output.getvalue() == expected


def run_shell(code):
    """Run the lines for ``glsk``; of those for ``make`` and ``benchmarks`` check targets and options."""
    for line in code.replace("\\\n", " ").splitlines():
        words = shlex.split(re.sub(r"[][]", "", line), comments=True)  # brackets: what may be left out
        if words[:1] == ["glsk"]:
            result = CliRunner().invoke(app, words[1:])
            assert result.exit_code == 0, f"glsk {shlex.join(words)}\n{result.output}\n{result.exception!r}"
        elif words[:1] == ["make"]:
            assert f"\n{words[1]}: " in (ROOT / "Makefile").read_text()
        elif "".join(words[1:2]).startswith("benchmarks/"):
            sources = [(ROOT / words[1]).read_text(), *(path.read_text() for path in ROOT.glob("benchmarks/**/*.py"))]
            assert all(f'"{word}"' in "".join(sources) for word in words if word.startswith("--"))


@pytest.mark.slow
@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")  # the clouds are small
def test_every_block_runs(path, prepared, tmp_path, monkeypatch, install):
    shutil.copytree(prepared, tmp_path / "work")
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.setattr(o3d.visualization, "draw_geometries", lambda shapes: None)
    monkeypatch.setattr("glsk_o3d.viewing.window.show", lambda *arguments, **options: None)
    blocks = [(language, body) for _, language, body in FENCE.findall(TEXT[path])]
    if path.name == "plugins.md":
        (code,), (entries,) = [b for _, b in blocks if "(Filter[" in b], [b for lang, b in blocks if lang == "toml"]
        groups = tomlkit.parse(entries)["project"]["entry-points"].items()
        install("glsk-slab", "0.1", code, "".join(f"[{g}]\n{n} = {v}\n" for g, it in groups for n, v in it.items()))
    cloud, skeleton = glsk.read_cloud("scan.ply"), glsk.read_skeleton("skeleton.json")
    names = dict(__name__="__main__", glsk=glsk, o3d=o3d, np=np, cloud=cloud, points=skeleton.points, skeleton=skeleton)
    for language, body in blocks:
        if language == "python":
            run_python(body, names)
        elif language in ("sh", "bash"):
            run_shell(body)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive")  # what plt.show() says where there is a screen
@pytest.mark.parametrize("script", sorted(ROOT.glob("docs/gallery/plot_*.py")), ids=lambda path: path.stem)
def test_a_script_of_the_gallery_draws_figures_and_leaves_nothing_behind(script, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("Agg")
    plt.close("all")
    runpy.run_path(str(script), run_name="__main__")
    assert [bool(figure.axes) for figure in map(plt.figure, plt.get_fignums()[:1])] == [True]
    assert [*tmp_path.iterdir()] == []


def anchors(path):
    """The anchors of a page's headings, as GitHub and the site name them."""
    titles = re.findall(r"^#+ (.*)$", PROSE[path], re.MULTILINE)
    plain = [re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title).replace("`", "").strip().lower() for title in titles]
    return {re.sub(r"[^\w\- ]", "", title).replace(" ", "-") for title in plain}


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_and_paths_lead_somewhere(path):
    for target in re.findall(r"\]\((?!\w+:)([^)\s]+)\)", PROSE[path]):
        file, _, anchor = target.partition("#")
        goal = (path.parent / file).resolve() if file else path
        assert goal.exists() or "generated" in goal.parts, target
        assert not anchor or anchor in anchors(goal), target
    for named in re.findall(r"`((?:glsk_o3d|tests|benchmarks|docs|examples|ros2)/[a-z\d_./*]+)`", PROSE[path]):
        assert [*ROOT.glob(named.rstrip("/"))] or named.startswith("benchmarks/results"), named
    levels = [len(marks) for marks in re.findall(r"^(#+) ", PROSE[path], re.MULTILINE)]
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))  # else Sphinx complains


def test_every_page_is_in_the_menu_and_every_picture_is_shown():
    menu = "".join(re.findall(r"```\{toctree\}(.*?)```", page("index.md"), re.DOTALL)).split()
    assert {path.stem for path in ROOT.glob("docs/*.md")} - {"index"} <= {*menu}
    searched = re.findall(r'^    "([\w/]+)":', (ROOT / "docs/_ext/keywords.py").read_text(), re.MULTILINE)
    assert [name for name in searched if not (ROOT / f"{name}.md").exists() and "generated" not in name] == []
    shown = [picture for text in PROSE.values() for picture in re.findall(r"!\[(.*?)\]\((.*?)\)", text)]
    assert all(words for words, _ in shown)
    assert {f"{draw.__name__}.png" for draw in figures.FIGURES} <= {Path(target).name for _, target in shown}


def test_every_equation_has_a_number_of_its_own_and_every_work_is_cited():
    equations = re.findall(r"\$\$(.*?)\$\$", "".join(PROSE.values()), re.DOTALL)
    numbers = {number for equation in equations for number in re.findall(r"\\tag\{([^}]+)\}", equation)[:1]}
    assert len(numbers) == len(equations) > 15
    works = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "docs" / "references.bib").read_text(), re.MULTILINE))
    assert {name for text in TEXT.values() for name in re.findall(r"\{cite:\w+\}`(\w+)`", text)} == works


NAMES = [(module, name) for module in (*api.PACKAGES, *api.MODULES) for name in api.names(module)]


@pytest.mark.parametrize("package", api.PACKAGES)
def test_every_public_name_has_its_page(package):
    optional = ["MeshSet"] * (package == "glsk_o3d")  # not in __all__, because it needs an extra
    assert sorted(api.names(package)) == sorted([*api.defined(package), *optional])


@pytest.mark.parametrize(("module", "name"), NAMES, ids=lambda word: word.removeprefix("glsk_o3d"))
def test_every_public_name_is_documented(module, name):
    thing = getattr(importlib.import_module(module), name)
    text = inspect.getdoc(thing)
    assert text
    if inspect.isclass(thing):
        members = {
            key for key, value in vars(thing).items() if isinstance(value, FunctionType | property | classmethod)
        }
        assert [key for key in members if key[0] != "_" and not inspect.getdoc(getattr(thing, key))] == []
    else:
        heads = re.findall(r"^([\w*, ]+?)(?: : .*)?$", text.partition("Parameters\n---")[2], re.MULTILINE)
        documented = {name.strip("* ") for head in heads for name in head.split(",")}
        assert set(inspect.signature(thing).parameters) <= documented


@pytest.mark.parametrize("cls", BUILTIN.values(), ids=lambda cls: cls.__name__)
def test_every_filter_has_a_page_with_all_its_options(cls):
    (path,) = re.findall(r"docs/(filters/\w+\.md)", inspect.getdoc(cls))
    assert path in CliRunner().invoke(app, ["filters", cls.__name__]).output
    (notes,) = re.findall(rf"```{{options}} {cls.__name__}\n(.*?)```", page(path), re.DOTALL)
    assert re.findall(r"^(\w+): .", notes, re.MULTILINE) == [field.name for field in dataclasses.fields(cls)]
    for section in ("What ", "Equations", "Example", "Options", "Cost", "Limits", "Source"):
        assert f"\n## {section}" in page(path)


def test_the_advice_on_options_can_be_taken():
    settings = re.findall(r"`(\w+\.\w+=[^`]+)`", page("troubleshooting.md"))
    assert len(settings) > 15
    assert all(override(glsk.pipelines.default(), [each]) != glsk.pipelines.default() for each in settings)
    calls = re.findall(rf"\b({'|'.join(BUILTIN)})\(([^()]+)\)", page("coming_from.md"))
    assert len(calls) > 20
    for cls, words in calls:
        assert {*re.findall(r"(\w+)=", words)} <= {field.name for field in dataclasses.fields(BUILTIN[cls])}


def test_figures_in_the_text_are_those_of_the_tables():
    table = page("evaluation.md").partition("<!-- ablation -->")[2].partition("<!-- end -->")[0]
    default, *rows = re.findall(r"^\| (?:default|without).* \| ([\d.]+ / \d+) \| (.*) \|$", table, re.MULTILINE)
    effects = re.findall(r"(`[^`]+`): ([\d.]+ / \d+) → ([\d.]+ / \d+); \w+:", page("differences.md"))
    assert {(setting, *both) for setting, *both in effects} == {(setting, default[0], value) for value, setting in rows}
    claims = page("index.md").partition("## What it is better at")[2].partition("\n## ")[0].split("\n- ")[1:]
    assert len(claims) > 3
    for claim in claims:
        linked = "".join(page(name) for name in re.findall(r"\]\((\w+\.md)", claim))
        assert {*re.findall(r"\d+\.\d+", claim)} <= {*re.findall(r"\d+\.\d+", linked)}, claim


def test_equations_of_the_paper_stand_in_the_functions_that_the_table_names():
    marked = {}
    for path in sorted((ROOT / "glsk_o3d").rglob("*.py")):
        module, tree = ".".join(path.relative_to(ROOT).with_suffix("").parts), ast.parse(path.read_text())
        owners = [(module, tree), *((f"{module}.{n.name}", n) for n in tree.body if isinstance(n, ast.ClassDef))]
        functions = {f"{k}.{n.name}": n for k, owner in owners for n in owner.body if isinstance(n, ast.FunctionDef)}
        for row, line in enumerate(path.read_text().splitlines(), 1):
            for number in re.findall(r"#.*\bWen \(([^)]*)\)", line):
                inside = {name for name, node in functions.items() if node.lineno <= row <= node.end_lineno}
                marked.setdefault(number, set()).update(inside or {f"{path}:{row}"})
    rows = re.findall(r"^\| (\d+) \| .+ \| (`glsk_o3d\.[^|]+`) \|$", page("method.md"), re.MULTILINE)
    assert [int(number) for number, _ in rows] == list(range(1, 17))
    assert marked == {number: set(re.findall(r"`([\w.]+)`", names)) for number, names in rows}
