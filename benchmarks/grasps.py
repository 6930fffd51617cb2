"""How safe grasps are: see the README."""

from glsk_studies.grasps import app

if __name__ == "__main__":
    app()
