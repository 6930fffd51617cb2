"""Whether the score of a skeleton is calibrated: see the README."""

from glsk_studies.verdicts import app

if __name__ == "__main__":
    app()
