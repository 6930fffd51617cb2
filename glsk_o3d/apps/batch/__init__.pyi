from .plan import Plan, plan_batch
from .run import BatchResult, run_batch
from .stream import Skeletonizer

__all__ = ["BatchResult", "Plan", "Skeletonizer", "plan_batch", "run_batch"]
