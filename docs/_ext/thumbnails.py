"""The small pictures of the gallery: of every script the panel that shows what one gets, cropped, and large enough."""

import math
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from PIL import Image
from sphinx_gallery.scrapers import matplotlib_scraper

SIZE = (480, 360)
MARGIN = 12  # pixels around the drawing
SHARPNESS = 250  # dots per inch before it is made smaller
USUAL, THICK = 2, 5  # points that a curve is thick in the scripts, and pixels here
LAST = (0, (-1,))
CHOSEN = {
    "plot_02_five_filters": (0, (0, 1, 2, 3)),
    "plot_05_libigl_crosscheck": (1, (0,)),
    "plot_06_noise_and_missing_data": (0, (1,)),
    "plot_07_tree_branches": (0, (0,)),
    "plot_11_baseline_paper_ours": (0, (2, 5, 8)),
    "plot_13_batch_with_dask": (0, (0, 1, 2, 3, 4, 5)),
    "plot_14_grasps": (1, (1,)),
}
"""Which figure, and which of its panels, where it is not the last panel of the first figure."""


def scrape(block, block_vars, gallery_conf):
    """What the gallery does with figures, and the small picture beside them."""
    before = len(block_vars["image_path_iterator"])
    figures = [plt.figure(number) for number in plt.get_fignums()]
    rst = matplotlib_scraper(block, block_vars, gallery_conf)
    script = Path(block_vars["src_file"]).stem
    number, panels = CHOSEN.get(script, LAST)
    if 0 <= number - before < len(figures):
        folder = Path(block_vars["image_path_iterator"].image_path).parent / "panels"
        folder.mkdir(parents=True, exist_ok=True)
        figure = figures[number - before]
        FigureCanvasAgg(figure)  # the gallery has closed it
        figure.canvas.draw()
        figure.set_layout_engine("none")
        drawings = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
        pictures = [panel(figure, drawings[place], len(panels)) for place in panels]
        joined(pictures).save(folder / f"{script}.png", optimize=True)
    return rst


def columns(n):
    """Of so many pictures."""
    return min(n, 3) if n in (3, 5, 6) else math.ceil(math.sqrt(n))


def panel(figure, axes, n):
    """One of n panels, alone, without title and scales, as large as fits; its curves are as thick in every picture."""
    room = (SIZE[0] // columns(n) - 2 * MARGIN, SIZE[1] // math.ceil(n / columns(n)) - 2 * MARGIN)
    for each in figure.axes:
        each.set_visible(each is axes)
    axes.set_title("")
    figure.set_dpi(SHARPNESS)
    cropped = inked(figure)
    scale = min(side / length for side, length in zip(room, cropped.size, strict=True))
    wider = THICK / math.sqrt(columns(n)) / (USUAL * SHARPNESS / 72 * scale)
    for curve in (each for each in axes.collections if isinstance(each, LineCollection)):
        curve.set_linewidth(wider * np.array(curve.get_linewidth()))
    cropped = inked(figure)
    cropped.thumbnail(room, Image.Resampling.LANCZOS)
    return cropped


def inked(figure):
    """What is not white."""
    figure.canvas.draw()
    picture = np.asarray(figure.canvas.buffer_rgba())[..., :3]
    rows, across = np.nonzero((picture < 250).any(axis=2))
    return Image.fromarray(picture[rows.min() : rows.max() + 1, across.min() : across.max() + 1])


def joined(pictures):
    """Pictures on a white one, in rows."""
    whole, wide = Image.new("RGB", SIZE, "white"), columns(len(pictures))
    cell = (SIZE[0] // wide, SIZE[1] // math.ceil(len(pictures) / wide))
    for number, picture in enumerate(pictures):
        corner = [
            cell[i] * place + (cell[i] - picture.size[i]) // 2 for i, place in enumerate(divmod(number, wide)[::-1])
        ]
        whole.paste(picture, corner)
    return whole


def put(app):
    """They take the place of those that the gallery has made of whole figures."""
    images = Path(app.srcdir, "docs", "generated", "gallery", "images")
    for picture in images.glob("panels/*.png"):
        (images / "thumb" / f"sphx_glr_{picture.stem}_thumb.png").write_bytes(picture.read_bytes())


def setup(app):
    app.connect("builder-inited", put, priority=900)  # after the scripts have run
    return {"parallel_read_safe": True, "parallel_write_safe": True}
