"""How a skeleton shows itself in Jupyter."""

from __future__ import annotations

import base64
import io
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.summary import point_count, structure
from ..errors import MissingPackageError
from ..interop.packages import require
from .figures import DPI
from .preview import draw

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
    image = Image.fromarray(drawn.copy()).quantize(NOTEBOOK_COLOURS, method=Image.Quantize.MEDIANCUT)
    image.save(stream, format="png", optimize=True)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


def to_html(skeleton: Skeleton) -> str:
    """A picture from three sides and the numbers, as a piece of HTML that needs nothing else.

    Without what draws pictures, the numbers and what to install.
    """
    counts = {"points": point_count(skeleton), **structure(skeleton)}
    style = 'style="text-align:right;padding:2px 10px"'  # all here, since not every notebook has Jupyter's sheet
    heads = "".join(f"<th {style}>{name}</th>" for name in counts)
    told = (f"{value:.4g}" if name == "length" else f"{value:,}" for name, value in counts.items())
    cells = "".join(f"<td {style}>{text}</td>" for text in told)
    image, missing = "", []
    try:
        style = 'style="width:100%;background:#fff;border-radius:4px"'
        image = f'<img alt="{escape(repr(skeleton))}" {style} src="{picture(skeleton)}">'
    except MissingPackageError as error:
        missing = [str(error)]
    style = 'style="margin:4px 0;border-left:3px solid #c77700;padding-left:8px"'
    messages = dict.fromkeys([*missing, *skeleton.report.warnings])
    warnings = "".join(f"<p {style}>{escape(text)}</p>" for text in messages)
    return (
        '<div style="max-width:1100px;font:13px/1.5 system-ui,sans-serif">'
        f'{image}<table style="font:inherit;border-collapse:collapse;margin-top:4px"><thead>'
        f"<tr>{heads}</tr></thead><tbody><tr>{cells}</tr></tbody></table>{warnings}</div>"
    )
