"""Whether a tracked object keeps its graph: see the README."""

from glsk_studies.tracking import app

if __name__ == "__main__":
    app()
