"""What `external.py` is made of: readers of other people's clouds and axes, one for each kind of data."""
