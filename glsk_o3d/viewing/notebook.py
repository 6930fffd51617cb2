"""How a skeleton shows itself in Jupyter."""

from __future__ import annotations

import base64
import io
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.summary import point_count
from ..errors import MissingPackageError
from ..interop.packages import require
from .preview import DPI, draw

if TYPE_CHECKING:
    from ..skeleton import Skeleton

NOTEBOOK_SIZE = (1200, 500)
NOTEBOOK_MARGIN = 16  # in pixels
NOTEBOOK_COLOURS = 48  # of the picture: greys, red, and what lies between; a third of the bytes of the full range


def picture(skeleton: Skeleton) -> str:
    """The preview as a ``data:`` address, for an HTML image."""
    require("PIL", "pillow")
    from PIL import Image

    figure, stream = draw(skeleton, NOTEBOOK_SIZE, None, caption=False), io.BytesIO()
    figure.set_dpi(DPI)
    figure.canvas.draw()
    drawn = np.asarray(figure.canvas.buffer_rgba())[..., :3]
    rows = np.flatnonzero((drawn < 250).any(axis=(1, 2)))  # without the white bands above and below flat drawings
    drawn = drawn[max(rows[0] - NOTEBOOK_MARGIN, 0) : rows[-1] + NOTEBOOK_MARGIN]
    Image.fromarray(drawn.copy()).quantize(NOTEBOOK_COLOURS, method=Image.Quantize.MEDIANCUT).save(
        stream, format="png", optimize=True
    )
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


def to_html(skeleton: Skeleton) -> str:
    """A picture from three sides and the numbers, as a piece of HTML that needs nothing else.

    Without what draws pictures, the numbers and what to install.
    """
    report = skeleton.report
    told = {
        "points": f"{point_count(skeleton):,}",
        "vertices": f"{len(skeleton.vertices):,}",
        "edges": f"{len(skeleton.edges):,}",
        "components": f"{skeleton.n_components:,}",
        "loops": f"{skeleton.n_loops:,}",
        "leaves": f"{len(skeleton.leaves):,}",
        "junctions": f"{len(skeleton.junctions):,}",
        "length": f"{skeleton.length:.4g}",
    }
    style = 'style="text-align:right;padding:2px 10px"'  # all here, since not every notebook has Jupyter's sheet
    heads = "".join(f"<th {style}>{name}</th>" for name in told)
    cells = "".join(f"<td {style}>{value}</td>" for value in told.values())
    image, missing = "", []
    try:
        image = (
            f'<img alt="{escape(repr(skeleton))}" style="width:100%;background:#fff;border-radius:4px" '
            f'src="{picture(skeleton)}">'
        )
    except MissingPackageError as error:
        missing = [str(error)]
    warnings = "".join(
        f'<p style="margin:4px 0;border-left:3px solid #c77700;padding-left:8px">{escape(text)}</p>'
        for text in dict.fromkeys([*missing, *report.warnings])
    )
    return (
        '<div style="max-width:1100px;font:13px/1.5 system-ui,sans-serif">'
        f'{image}<table style="font:inherit;border-collapse:collapse;margin-top:4px"><thead>'
        f"<tr>{heads}</tr></thead><tbody><tr>{cells}</tr></tbody></table>{warnings}</div>"
    )
