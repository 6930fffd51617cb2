"""A file format a module: skeletons, and the cylinders of trees, as bytes and back."""
