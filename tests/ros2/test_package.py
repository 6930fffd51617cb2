"""What colcon and ros2 launch find: setup.py, package.xml and the launch file, with stand-ins for what they import."""

import ast
import re
import runpy
import sys
from types import ModuleType, SimpleNamespace
from typing import get_origin
from xml.etree import ElementTree

import pytest


@pytest.fixture
def facts(package):
    return ElementTree.parse(package / "package.xml").getroot()


@pytest.fixture
def installed(package, monkeypatch):
    """What setup.py tells setuptools."""
    told = {}
    setuptools = ModuleType("setuptools")
    setuptools.setup = lambda **what: told.update(what)
    monkeypatch.setitem(sys.modules, "setuptools", setuptools)
    monkeypatch.chdir(package)
    runpy.run_path("setup.py")
    return told


def test_setup_installs_what_ament_looks_for(package, facts, installed):
    name = facts.findtext("name")
    assert facts.findtext("export/build_type") == "ament_python"
    assert installed["name"] == name == package.name
    assert installed["version"] == facts.findtext("version")
    assert installed["packages"] == [name]
    where = {target: files for target, (*files,) in installed["data_files"]}
    assert where["share/ament_index/resource_index/packages"] == [f"resource/{name}"]
    assert where[f"share/{name}"] == ["package.xml"]
    assert where[f"share/{name}/launch"] == [f"launch/{path.name}" for path in (package / "launch").glob("*.py")]
    assert all((package / file).is_file() for files in where.values() for file in files)
    assert f"$base/lib/{name}\n" in (package / "setup.cfg").read_text()  # where ros2 run looks


def test_package_xml_names_all_that_is_imported(package, facts):
    named = {depend.text for depend in facts.findall("exec_depend")}
    imported = set()
    for path in package.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                imported.update(alias.name.split(".")[0] for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and not node.level:
                imported.add(node.module.split(".")[0])
            elif isinstance(node, ast.Constant) and "/msg/" in str(node.value) and " " not in node.value:
                imported.add(node.value.split("/")[0])
    python = {"numpy": "python3-numpy", "scipy": "python3-scipy"}
    elsewhere = {"glsk_o3d", package.name, "rosbags", "setuptools", *sys.stdlib_module_names}
    assert {python.get(name, name) for name in imported - elsewhere} == named


def test_the_launch_file_starts_the_node_with_its_parameters(package, ros, installed, monkeypatch):
    def module(name, **names):
        made = ModuleType(name)
        vars(made).update(names)
        monkeypatch.setitem(sys.modules, name, made)

    def remember(*words, **named):
        return SimpleNamespace(words=words, **named)

    module("launch", LaunchDescription=list)
    module("launch.actions", DeclareLaunchArgument=remember)
    module("launch.substitutions", LaunchConfiguration=str)
    module("launch_ros")
    module("launch_ros.actions", Node=remember)
    module("launch_ros.parameter_descriptions", ParameterValue=remember)
    names = runpy.run_path(str(package / "launch" / "skeletonize.launch.py"))
    *arguments, node = names["generate_launch_description"]()
    (script,) = installed["entry_points"]["console_scripts"]
    assert (node.package, node.executable) == (package.name, script.partition(" ")[0])
    (parameters,) = node.parameters
    assert [argument.words[0] for argument in arguments] == ["input", *parameters]
    assert node.remappings == [("~/input", "input")]

    asked = ros.node().defaults
    assert list(asked) == list(parameters)
    for argument in arguments[1:]:
        (name,) = argument.words
        kind = parameters[name].value_type
        assert parameters[name].words == (name,)
        value = ast.literal_eval(argument.default_value) if get_origin(kind) is list else kind(argument.default_value)
        assert (value, type(value)) == (asked[name], type(asked[name]))


def test_the_page_has_a_row_for_every_parameter_topic_and_service(package, ros):
    page = (package.parents[1] / "docs" / "robots.md").read_text(encoding="utf-8")
    node = ros.node()
    assert re.findall(r"^\| `([a-z_]+)` \| (?!`)", page, re.M) == list(node.defaults)
    assert set(re.findall(r"^\| `(~/[a-z]+)`", page, re.M)) == set(node.topics)
