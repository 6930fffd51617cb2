from .jobs import BatchResult, Plan, Task
from .plan import plan_batch
from .run import run_batch

__all__ = ["BatchResult", "Plan", "Task", "plan_batch", "run_batch"]
