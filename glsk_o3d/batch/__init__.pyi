from .plan import Plan, Task
from .planning import plan_batch
from .run import BatchResult, run_batch

__all__ = ["BatchResult", "Plan", "Task", "plan_batch", "run_batch"]
