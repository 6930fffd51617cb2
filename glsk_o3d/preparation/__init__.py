"""The steps before there are rings, one file each: points in, points out."""
