from .intervals import mean_with_interval

__all__ = ["mean_with_interval"]
