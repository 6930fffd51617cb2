"""The stages that runs are split into, and the groups in which a picture shows them: to be kept as the package is."""

from .stopwatch import REST, Stage

STAGES = {
    "order": Stage("numerics.morton:morton_order"),
    "kNN": Stage("numerics.neighbourhoods:nearest_neighbours,nearest_left"),
    "outliers, noise": Stage(
        "preparation.outliers:inliers preparation.surface:noise_share "
        "preparation.denoising:average_noisy,subspace_mean_shift"
    ),
    "planes": Stage("numerics.neighbourhoods:principal"),
    "thinning": Stage("preparation.sampling:sample_grid preparation.thinning:thin,spacing_enough,thin_nearer"),
    "rings": Stage("numerics.rings:star_rings"),
    "rest of the rings": Stage("ring_builder:RingBuilder._run", open=True),
    "Laplacian": Stage("numerics.cotangent:cotangent_laplacian"),
    "lines": Stage("contractor:explained_variance"),
    "normal matrix": Stage("numerics.solver:solve_contraction", open=True),
    "factorisation": Stage("numerics.solver:factorised"),
    "refinement of the solve": Stage(after=("normal matrix", "factorisation"), open=True),
    "LPR": Stage("lpr_reducer:LPRReducer._run"),
    "rest of the contraction": Stage("contractor:Contractor._run", open=True),
    "sampling": Stage("connector:contraction_distance numerics.farthest_point:farthest_point_sampling"),
    "connection": Stage("connector:Connector._run", open=True),
    "refinement of the graph": Stage("refiner:Refiner._run"),
}
"""The stages in the order of the tables, and the functions that do their work."""

SHARES = {
    "neighbours": (("order", "kNN"), "#1f4e9c"),
    "thinning": (("thinning",), "#5b8bd0"),
    "rings, rest": (("outliers, noise", "planes", "rings", "rest of the rings"), "#b3cdee"),
    "solves": (("normal matrix", "factorisation", "refinement of the solve"), "#d95f02"),
    "contraction, rest": (("Laplacian", "lines", "rest of the contraction"), "#fbb676"),
    "point reduction": (("LPR",), "#fde4c8"),
    "connection": (("sampling", "connection"), "#bbbbbb"),
    "refinement": (("refinement of the graph",), "#777777"),
    "rest": ((REST,), "#333333"),
}
"""The stages in groups that a picture can show, in the order of the work, and their colours: one for each filter."""
