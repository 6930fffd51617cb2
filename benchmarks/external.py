"""Other people's data as a benchmark: see the README."""

from glsk_studies.external import app

if __name__ == "__main__":
    app()
