"""What other tools make of the public benchmark: see the README."""

from glsk_studies.leaderboard import app

if __name__ == "__main__":
    app()
