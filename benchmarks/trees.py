"""What skeletons of trees are worth: see the README."""

from glsk_studies.trees import app

if __name__ == "__main__":
    app()
