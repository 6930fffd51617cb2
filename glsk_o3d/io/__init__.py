"""Clouds and skeletons from files and to files, and as geometries of Open3D."""
