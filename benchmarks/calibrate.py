"""Whether what is probable is so as often: see the README."""

from glsk_studies.calibrate import app

if __name__ == "__main__":
    app()
