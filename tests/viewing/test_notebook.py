"""How a skeleton shows itself in Jupyter."""

import base64
import dataclasses
import io
import re
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.image import imread

from glsk_o3d.report import Report
from glsk_o3d.viewing.html import to_html


def image_of(html):
    (address,) = re.findall(r'src="data:image/png;base64,([^"]*)"', html)
    return imread(io.BytesIO(base64.b64decode(address)))


def test_is_sound_and_self_contained(skeleton):
    html = to_html(skeleton)
    open_tags = []
    for closing, tag in re.findall(r"<(/?)(\w+)", html):
        if closing:
            assert open_tags.pop() == tag
        elif tag != "img":
            open_tags.append(tag)
    assert open_tags == []
    assert not re.search(r"https?:|<script|<link|url\(", html)
    picture = image_of(html)
    assert ((picture[..., 0] > 0.7) & (picture[..., 1] < 0.4)).sum() > 30  # red
    assert f">{len(skeleton.vertices):,}</td>" in html
    assert f">{skeleton.length:.4g}</td>" in html


def test_is_small_even_for_large_clouds(tree):
    points = np.random.default_rng(0).normal(size=(100_000, 3))
    many = dataclasses.replace(tree, points=points, normals=None, vertex_of_point=np.zeros(len(points), int))
    assert len(to_html(many)) < 200_000


def test_warnings_are_texts(tree):
    assert ">&lt;b&gt;&amp;</p>" in to_html(dataclasses.replace(tree, report=Report(warnings=("<b>&",))))


JUPYTER = """
from IPython.core.interactiveshell import InteractiveShell
shell = InteractiveShell.instance()
import glsk_o3d
from glsk_o3d.samples import torus
from glsk_o3d.viewing.html import to_html
ring = glsk_o3d.skeletonize(torus(500).points)
bundle, _ = shell.display_formatter.format(ring)
assert bundle["text/html"] == to_html(ring)
assert bundle["text/plain"] == repr(ring)
"""


def test_jupyter_finds_it():
    pytest.importorskip("IPython")
    done = subprocess.run([sys.executable, "-c", JUPYTER], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
