"""What `trees.py` is made of: clouds of trees, the tools that are run on them, and what is measured."""
