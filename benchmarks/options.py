"""What some options are worth: see the README."""

from glsk_studies.options import app

if __name__ == "__main__":
    app()
