"""What `grasps.py` is made of: objects whose inside is known, and grasps judged by it."""
