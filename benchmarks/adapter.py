"""One of the other tools on one cloud: see the README."""

import os

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MPLBACKEND="Agg")  # before NumPy

from glsk_studies.adapter import app

if __name__ == "__main__":
    app()
