"""Pipes, devices, sockets, folders and links in circles in the place of files: one line each, and nothing waits."""

import os
import socket

import numpy as np
import pytest

from glsk_o3d.samples import torus

SPECIAL = {
    "pipe": "is a pipe or a device",
    "device": "is a pipe or a device",
    "socket": "is a pipe or a device",
    "folder": "is a folder",
    "circle": "no such file",
}
INPUTS = """
    skeletonize odd.ply -o o.ply
    skeletonize s.xyz -o o.ply --pipeline odd.json
    batch s.xyz -o out --pipeline odd.json
    run odd.mlx s.xyz -o o.ply
    evaluate y.ply s.xyz --truth odd.npz
    grasps y.ply --opening 1 --cloud odd.ply
    convert odd.obj o.ply
    rig y.ply odd.ply -o o.glb
    info odd.vtp
"""
OUTPUTS = """
    skeletonize s.xyz -o odd.ply
    skeletonize s.xyz --preview odd.png
    branches y.ply -o odd.csv
    rig y.ply -o odd.glb
"""


@pytest.fixture(params=SPECIAL)
def special(request, y, tmp_path):
    """Put something odd in the place of a file of a command line; gives its name and what it is."""
    np.savetxt(tmp_path / "s.xyz", torus(300).points)
    kind = request.param

    def make(line):
        path = tmp_path / next(word for word in line.split() if word.startswith("odd."))
        if kind == "pipe":
            os.mkfifo(path)
        elif kind == "socket":
            with socket.socket(socket.AF_UNIX) as listening:
                listening.bind(str(path))
        elif kind == "folder":
            path.mkdir()
        else:
            path.symlink_to("/dev/zero" if kind == "device" else path)
        return path.name, kind

    return make


@pytest.mark.parametrize("line", INPUTS.strip().splitlines())
def test_as_an_input(invoke, special, tmp_path, line):
    name, kind = special(line)
    before = {path.name for path in tmp_path.iterdir()}
    result = invoke(*line.split())
    assert (result.exit_code in (1, 2), result.stdout) == (True, ""), result.output
    assert result.stderr.count("\n") == 1
    assert name in result.stderr
    assert SPECIAL[kind] in result.stderr
    assert {path.name for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("line", OUTPUTS.strip().splitlines())
def test_as_an_output(refused, special, line):
    name, kind = special(line)
    if kind != "circle":  # it is replaced
        assert refused(1, *line.split()) == f"{name}: is a folder or a device, not a file to write to"
