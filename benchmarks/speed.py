"""How fast skeletons are: see the README."""

from glsk_studies.speed import app

if __name__ == "__main__":
    app()
