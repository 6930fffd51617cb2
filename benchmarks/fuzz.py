"""What breaks: see the README."""

import os

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")  # before NumPy: the same on any machine

from glsk_studies.fuzz import app

if __name__ == "__main__":
    app()
