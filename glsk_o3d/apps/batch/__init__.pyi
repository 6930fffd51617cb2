from .plan import Plan, plan_batch
from .run import BatchResult, run_batch

__all__ = ["BatchResult", "Plan", "plan_batch", "run_batch"]
