from .plan import Plan, plan_batch
from .run import BatchResult, run_batch
from .tasks import Task

__all__ = ["BatchResult", "Plan", "Task", "plan_batch", "run_batch"]
