"""Recipes: pipelines as plain dicts, and as JSON files.

A recipe is ``{"glsk_o3d": {"version": 1}, "pipeline": [{"filter": "RingBuilder", "k": 20}, ...]}``: a table per stage,
with its parameters; a reducer inside is a table with ``"filter"`` and a stopping rule one with ``"rule"``. Parameters
that are left out have their defaults. ``"none"`` stands for None.
"""

from .recipe import RECIPE_ENDING, from_recipe, load_recipe, save_recipe, to_recipe

__all__ = ["RECIPE_ENDING", "from_recipe", "load_recipe", "save_recipe", "to_recipe"]
