"""How far skeletons are from known axes: see the README."""

from glsk_studies.accuracy import app

if __name__ == "__main__":
    app()
