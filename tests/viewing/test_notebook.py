"""How a skeleton shows itself in Jupyter."""

import base64
import dataclasses
import io
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.image import imread

from glsk_o3d.report import Report


class Strict(HTMLParser):
    """Fails on tags that are not closed in their order."""

    def __init__(self):
        super().__init__()
        self.open, self.images, self.words = [], [], []

    def handle_starttag(self, tag, attrs):
        if tag == "img":
            self.images.append(dict(attrs)["src"])
        else:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


def parsed(html):
    parser = Strict()
    parser.feed(html)
    parser.close()
    assert parser.open == []
    return parser


def test_is_sound_and_self_contained(skeleton):
    html = skeleton._repr_html_()
    found = parsed(html)
    (image,) = found.images
    assert not re.search(r"https?:|<script|<link|url\(", html)
    picture = imread(io.BytesIO(base64.b64decode(image.removeprefix("data:image/png;base64,"))))
    red = (picture[..., 0] > 0.7) & (picture[..., 1] < 0.4)
    assert red.sum() > 30
    assert f"{len(skeleton.vertices):,}" in found.words
    assert f"{skeleton.length:.4g}" in found.words


def test_is_small_even_for_large_clouds(tree):
    points = np.random.default_rng(0).normal(size=(300_000, 3))
    many = dataclasses.replace(tree, points=points, normals=points, vertex_of_point=np.zeros(len(points)))
    assert len(many._repr_html_()) < 200_000


def test_no_white_band_around_the_drawing(make):
    long = make(np.array([[0, 0, 0], [9, 0, 0], [9, 0.5, 0.5]]), [[0, 1], [1, 2]])
    long = dataclasses.replace(long, points=(), normals=(), vertex_of_point=())
    (image,) = parsed(long._repr_html_()).images
    picture = imread(io.BytesIO(base64.b64decode(image.removeprefix("data:image/png;base64,"))))
    inked = np.flatnonzero((picture[..., :3] < 0.9).any(axis=(1, 2)))
    assert inked[0] < 25
    assert inked[-1] > len(picture) - 25


def test_warnings_are_texts(tree):
    html = dataclasses.replace(tree, report=Report(warnings=("<b>&",)))._repr_html_()
    assert "<b>&" in parsed(html).words


def test_jupyter_finds_it(tree):
    formatters = pytest.importorskip("IPython.core.formatters")
    bundle, _ = formatters.DisplayFormatter().format(tree)
    assert bundle["text/html"] == tree._repr_html_()
    assert bundle["text/plain"] == repr(tree)
