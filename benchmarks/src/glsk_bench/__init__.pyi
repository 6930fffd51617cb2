from .folders import BenchmarkFolder, read_folder
from .making import make
from .own import add_shape
from .running import run
from .scoring import Results, Scores, read_results, score, score_answers
from .table import Leaderboard, leaderboard
from .truths import ThingTruth

__all__ = [
    "BenchmarkFolder",
    "Leaderboard",
    "Results",
    "Scores",
    "ThingTruth",
    "add_shape",
    "leaderboard",
    "make",
    "read_folder",
    "read_results",
    "run",
    "score",
    "score_answers",
]
