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
    "dangling": "no such file",
}
INPUTS = """
    skeletonize {}.ply -o o.ply
    skeletonize {}.laz -o o.ply
    skeletonize {}.stl -o o.ply
    skeletonize s.xyz -o o.ply --pipeline {}.json
    batch s.xyz -o out --pipeline {}.json
    run {}.mlx s.xyz -o o.ply
    evaluate {}.json s.xyz
    evaluate y.ply {}.xyz
    evaluate y.ply s.xyz --truth {}.npz
    branches {}.npz
    grasps y.ply --opening 1 --cloud {}.ply
    convert {}.obj o.ply
    rig y.ply {}.ply -o o.glb
    info {}.vtp
"""


def make_special(path, kind):
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(str(path))
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to(path if kind == "circle" else path.with_name("gone"))


@pytest.mark.parametrize("kind", SPECIAL)
@pytest.mark.parametrize("words", INPUTS.strip().splitlines(), ids=lambda words: " ".join(words.split()[:2]))
def test_as_an_input(invoke, y, tmp_path, words, kind):
    np.savetxt(tmp_path / "s.xyz", torus(300).points)
    name = next(word for word in words.split() if "{}" in word).format("odd")
    make_special(tmp_path / name, kind)
    before = {path.name for path in tmp_path.iterdir()}
    result = invoke(*words.format("odd").split())
    assert (result.exit_code in (1, 2), result.stdout) == (True, ""), result.output
    assert result.stderr.count("\n") == 1
    assert name in result.stderr
    assert SPECIAL[kind] in result.stderr
    assert {path.name for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("kind", ["pipe", "device", "socket", "folder"])
@pytest.mark.parametrize(
    "words",
    [
        "skeletonize s.xyz -o {}.ply",
        "skeletonize s.xyz --preview {}.png",
        "skeletonize s.xyz --labelled {}.ply",
        "branches y.ply -o {}.csv",
        "convert y.ply {}.json",
        "rig y.ply -o {}.glb",
    ],
)
def test_as_an_output(refused, y, tmp_path, words, kind):
    np.savetxt(tmp_path / "s.xyz", torus(300).points)
    name = words.split()[-1].format("odd")
    make_special(tmp_path / name, kind)
    assert refused(1, *words.format("odd").split()) == f"{name}: is a folder or a device, not a file to write to"
