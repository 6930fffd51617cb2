"""MeshLab: its filters and ours, one after the other, in Python and in filter scripts.

`script` reads and writes .mlx, `verbs` are our filters under MeshLab's kind of names, `builtin` knows MeshLab's own,
`steps` brings them together, and `meshset` is ``pymeshlab.MeshSet`` with all of it.
"""
