"""The small pictures of the gallery: of every script the panel that shows what one gets, cropped, and large enough."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image
from sphinx_gallery.scrapers import matplotlib_scraper

SIZE = (480, 360)
MARGIN = 12  # pixels around the drawing
SHARPNESS = 250  # dots per inch before it is made smaller
LAST = (0, (-1,))
CHOSEN = {
    "plot_05_libigl_crosscheck": (1, (0,)),
    "plot_06_noise_and_missing_data": (0, (1,)),
    "plot_07_tree_branches": (0, (0,)),
    "plot_11_baseline_paper_ours": (0, (0, 3, 6)),
    "plot_13_batch_with_dask": (0, (0,)),
    "plot_14_grasps": (1, (0,)),
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
        drawn(figures[number - before], panels).save(folder / f"{script}.png", optimize=True)
    return rst


def drawn(figure, panels):
    """These panels alone, without titles, scales and white edges."""
    FigureCanvasAgg(figure)  # the gallery has closed the figure
    figure.canvas.draw()
    figure.set_layout_engine("none")
    drawings = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    chosen = [drawings[panel] for panel in panels]
    for axes in figure.axes:
        axes.set_visible(axes in chosen)
        axes.set_title("")
    figure.set_dpi(SHARPNESS)
    figure.canvas.draw()
    picture = np.asarray(figure.canvas.buffer_rgba())[..., :3]
    rows, columns = np.nonzero((picture < 250).any(axis=2))
    cropped = Image.fromarray(picture[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1])
    scale = min((side - 2 * MARGIN) / length for side, length in zip(SIZE, cropped.size, strict=True))
    cropped = cropped.resize([max(1, round(scale * length)) for length in cropped.size], Image.Resampling.LANCZOS)
    whole = Image.new("RGB", SIZE, "white")
    whole.paste(cropped, [(side - length) // 2 for side, length in zip(SIZE, cropped.size, strict=True)])
    return whole


def put(app):
    """They take the place of those that the gallery has made of whole figures."""
    images = Path(app.srcdir, "docs", "generated", "gallery", "images")
    for picture in images.glob("panels/*.png"):
        (images / "thumb" / f"sphx_glr_{picture.stem}_thumb.png").write_bytes(picture.read_bytes())


def setup(app):
    app.connect("builder-inited", put, priority=900)  # after the scripts have run
    return {"parallel_read_safe": True, "parallel_write_safe": True}
