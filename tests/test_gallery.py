"""The scripts of the gallery, run as they are."""

import runpy
import sys
from pathlib import Path

import pytest

matplotlib = pytest.importorskip("matplotlib")
import matplotlib.pyplot as plt  # noqa: E402

GALLERY = Path(__file__).resolve().parents[1] / "docs" / "gallery"
NEEDS = {
    "plot_04_meshlab_script": "pymeshlab",
    "plot_13_batch_with_dask": "distributed",
    "plot_17_plot_of_trees": "lazrs",
    "plot_18_rig": "pygltflib",
}


@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive")  # what plt.show() says where there is a screen
@pytest.mark.parametrize("script", sorted(GALLERY.glob("plot_*.py")), ids=lambda path: path.stem)
def test_runs(script, tmp_path, monkeypatch, capsys):
    if script.stem in NEEDS:
        pytest.importorskip(NEEDS[script.stem])
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(script)])
    plt.switch_backend("Agg")
    plt.close("all")
    try:
        variables = runpy.run_path(str(script), run_name="__main__")
        assert plt.get_fignums()
        for number in plt.get_fignums():
            canvas = plt.figure(number).canvas
            canvas.draw()
            drawn = memoryview(canvas.buffer_rgba()).tobytes()
            assert len(set(drawn)) > 10  # it is not blank
    finally:
        plt.close("all")
    assert list(tmp_path.iterdir()) == []  # they tidy up
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    assert variables["__doc__"].split("\n")[2].startswith("===")
