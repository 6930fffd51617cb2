"""How much each number that steers the default skeleton matters: see the README."""

from glsk_studies.sensitivity import app

if __name__ == "__main__":
    app()
