"""Clouds from the files of other programs, whole or a part of their points."""
