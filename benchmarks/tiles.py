"""What becomes of a large scene in tiles: see the README."""

from glsk_studies.tiles import app

if __name__ == "__main__":
    app()
