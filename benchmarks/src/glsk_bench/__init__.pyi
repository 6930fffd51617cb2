from .folders import BenchmarkFolder, read_folder
from .making import make
from .own import add_shape
from .rating import draw_sheet, kappa, rates
from .repeating import Repeat, repeat, spread
from .running import run
from .sampling import sample
from .scoring import Results, Scores, read_results, score, score_answers
from .table import Leaderboard, leaderboard
from .truths import ThingTruth

__all__ = [
    "BenchmarkFolder",
    "Leaderboard",
    "Repeat",
    "Results",
    "Scores",
    "ThingTruth",
    "add_shape",
    "draw_sheet",
    "kappa",
    "leaderboard",
    "make",
    "rates",
    "read_folder",
    "read_results",
    "repeat",
    "run",
    "sample",
    "score",
    "score_answers",
    "spread",
]
