"""What batches do: see the README."""

from glsk_studies.batch import app

if __name__ == "__main__":
    app()
