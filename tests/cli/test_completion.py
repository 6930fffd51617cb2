"""What the shell completes."""

import os
import subprocess
import sys

import pytest

from glsk_o3d.cli.completion import OWN_PIPELINES, join_words
from glsk_o3d.pipelines import PIPELINES

RUN = """
import sys
from glsk_o3d.cli.main import app
try:
    app(prog_name="glsk")
finally:
    assert "open3d" not in sys.modules
"""


def completed(*words, shell="bash"):
    """What a shell is told, with the cursor behind the last word; zsh and fish do not part words at ``=``."""
    line = {"COMP_WORDS": "\n".join(words), "COMP_CWORD": str(len(words) - 1)}
    if shell == "zsh":
        line = {"_TYPER_COMPLETE_ARGS": " ".join(words)}
    environment = {**os.environ, "_GLSK_COMPLETE": f"complete_{shell}", **line}
    run = subprocess.run([sys.executable, "-c", RUN], capture_output=True, text=True, env=environment)
    assert run.stderr == ""
    return run.stdout.split()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("skeletonize a.ply --pipeline w", ["wen2024"]),
        ("skeletonize a.ply --set Refiner.co", ["Refiner.collapse=length", "Refiner.collapse=degree"]),
        ("skeletonize a.ply --set Refiner.li", ["Refiner.limb=0.25"]),
        ("skeletonize a.ply --set drop", ["drop_invalid=true", "drop_invalid=false"]),
        ("skeletonize a.ply --set Refiner.collapse =", ["length", "degree"]),
        ("skeletonize a.ply --set k = 3 --set Contractor.stop = Ri", ["RingSizeRatio"]),
        ("batch in --pipeline wen2024 --set Tracer.", []),
        ("batch in --set Tracer.", ["Tracer.surface=", "Tracer.root="]),
        ("batch in --recipe none.json --set Tracer.", []),
        ("run scan_cleanup_", ["scan_cleanup_then_skeleton"]),
    ],
)
def test_bash(words, expected):
    assert completed("glsk", *words.split()) == expected


def test_a_shell_that_does_not_part_words():
    assert "Refiner.collapse=degree" in " ".join(completed("glsk", "batch", "--set", "Refiner.collapse=d", shell="zsh"))


def test_every_parameter_is_named_and_nothing_is_parted_but_settings():
    named = completed("glsk", "skeletonize", "a.ply", "--set", "")
    assert "LPRReducer.order=" in named
    assert all("." in name for name in named)
    line = {"_GLSK_COMPLETE": "complete_bash", "COMP_WORDS": "glsk\ninfo\na\n=\nb\n", "COMP_CWORD": "5"}
    joined = dict(line)
    join_words(joined)
    assert joined == line
    short = {"_GLSK_COMPLETE": "complete_bash", "COMP_WORDS": "glsk info", "COMP_CWORD": "2"}
    join_words(short)
    assert short["COMP_WORDS"] == "glsk info"


def test_the_names_written_out_are_those_there_are():
    assert set(OWN_PIPELINES) == set(PIPELINES)
