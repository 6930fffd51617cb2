from .answers import Results, read_results, score_answers
from .folders import BenchmarkFolder, CloudFile, read_folder
from .making import make
from .own import add_shape
from .running import RunResult, run
from .scoring import Scores, score
from .table import Leaderboard, leaderboard
from .versions import Version, version

__all__ = [
    "BenchmarkFolder",
    "CloudFile",
    "Leaderboard",
    "Results",
    "RunResult",
    "Scores",
    "Version",
    "add_shape",
    "leaderboard",
    "make",
    "read_folder",
    "read_results",
    "run",
    "score",
    "score_answers",
    "version",
]
