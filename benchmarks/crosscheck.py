"""What a cross-check is worth: see the README."""

from glsk_studies.crosscheck import app

if __name__ == "__main__":
    app()
