"""The scripts of the gallery, run as they are."""

import runpy
import sys
from pathlib import Path

import pytest

plt = pytest.importorskip("matplotlib.pyplot")
GALLERY = Path(__file__).resolve().parents[1] / "docs" / "gallery"
NEEDS = {"plot_04": "pymeshlab", "plot_13": "distributed", "plot_17": "lazrs", "plot_18": "pygltflib"}


@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive")  # what plt.show() says where there is a screen
@pytest.mark.parametrize("script", sorted(GALLERY.glob("plot_*.py")), ids=lambda path: path.stem)
def test_a_script_draws_figures_and_leaves_nothing_behind(script, tmp_path, monkeypatch):
    if script.stem[:7] in NEEDS:
        pytest.importorskip(NEEDS[script.stem[:7]])
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(script)])
    plt.switch_backend("Agg")
    plt.close("all")
    runpy.run_path(str(script), run_name="__main__")
    figures = [plt.figure(number) for number in plt.get_fignums()]
    plt.close("all")
    assert figures
    assert all(axes.has_data() for figure in figures for axes in figure.axes[:1])
    assert [*tmp_path.iterdir()] == []
