"""What readers search for, and the page that they want: entries of an index that only the search uses."""

from sphinx.addnodes import index

KEYWORDS = {
    "docs/start": "start, tutorial, quick start, getting started, install, installation",
    "docs/method": "method, algorithm, how it works, laplacian, contraction, equations",
    "docs/parameters": "parameters, settings, options, tuning, noise, noisy, sparse, radius, slow",
    "docs/report": "report, warning, warnings, confidence, stop reason, decisions",
    "docs/limits": "limits, limitations, failure, failures, wrong, fails, sphere, sheet, large clouds, memory",
    "docs/coming_from": "matlab, cloudcontr, migration, coming from, pc-skeletor, skeletor, cgal",
    "docs/open3d": "open3d, annotate, attributes, colours, colors, tubes, tensor, downsample, point reduction",
    "docs/branches": "branch, branches, segmentation, segment, label, labels, length",
    "docs/trees": "tree, trees, plant, plants, forestry, forest, qsm, treeqsm, cylinders, volume, dbh, stem, crown",
    "docs/editing": "edit, editing, detail, prune, simplify, reroot, cut loops, rig, armature, convert",
    "docs/depth_camera": "depth camera, depth image, rgb-d, rgbd, realsense, kinect, flying pixels, mixed pixels, veil",
    "docs/grasping": "grasp, grasps, grasping, gripper, manipulation, pick, picking",
    "docs/robots": "robot, robots, ros, ros2, ros 2, urdf, bag, rosbag, node",
    "docs/meshlab": "meshlab, pymeshlab, mlx, filter script, filter scripts",
    "docs/batch": "batch, parallel, dask, cluster, tiles, ledger, many clouds, many scans",
    "docs/viewing": "view, viewer, plot, preview, notebook, picture, html, window, visualization, visualisation",
    "docs/recipes": "recipe, recipes, reproducible, repeat, json, pipeline",
    "docs/formats": "format, formats, file, files, save, read, load, export, las, laz, e57, ply, swc, gltf, csv, units",
    "docs/plugins": "plugin, plugins, entry points, own filter, extend, custom filter",
    "docs/accuracy": "accuracy, accurate, error, benchmark of accuracy",
    "docs/speed": "speed, fast, performance, time, runtime, memory use, scaling",
    "docs/comparison": "comparison, compare, other tools, pygel3d, versus, alternatives",
    "docs/benchmark": "benchmark, benchmarks, score, scores",
    "docs/evaluation": "evaluate, evaluation, measures, metrics, truth, assess",
    "docs/crosscheck": "crosscheck, cross-check, libigl, mesh, Poisson, genus, eigenvalues, verdict, trust",
    "docs/numbers": "numbers, constants, thresholds, defaults",
    "docs/differences": "differences, published code",
    "docs/paper": "paper, publication, abstract, novelty, ablation",
    "docs/filters/index": "filter, filters",
    "docs/filters/sampler": "sampler, sample, sampling, nan, duplicates",
    "docs/filters/outlier_remover": "outlier remover, outlierremover, outliers, outlier, lof",
    "docs/filters/denoiser": "denoiser, denoise, denoising, ridge, mean shift",
    "docs/filters/thinner": "thinner, thin, thinning, too many points",
    "docs/filters/ring_builder": "ring builder, ringbuilder, rings, one-ring, neighbours, neighbors",
    "docs/filters/inscriber": "inscriber, narrow holes, inscribed balls, medial axis",
    "docs/filters/contractor": "contractor, solver, weights",
    "docs/filters/lpr_reducer": "lpr reducer, lprreducer, lpr, reducer, reduction, local point reduction",
    "docs/filters/connector": "connector, connect, graph",
    "docs/filters/refiner": "refiner, refine, refinement, loops, loop, handles, spurs, gaps, bridge, air",
    "docs/filters/tracer": "tracer, trace, traced, twigs, sparse tree",
    "docs/filters/stopping": "stopping, stop, stopping rules, convergence",
    "docs/conventions": "conventions, frame, sign, coordinates, georeferenced",
    "docs/glossary": "glossary, terms, words",
    "docs/references": "references, bibliography, citations, literature",
    "docs/architecture": "architecture, modules, imports, design",
    "docs/releasing": "release, releases, releasing",
    "docs/generated/api/index": "api, api reference, functions, classes",
    "docs/generated/gallery/index": "gallery, examples, example, scripts",
    "CONTRIBUTING": "contributing, contribute, development, tests, style",
    "CHANGELOG": "changelog, changes, versions, what is new",
}
"""Words by page; each word leads to one page. Options of filters lead to their own place by themselves."""


def add(app, doctree):
    """Entries of the whole page."""
    words = [word.strip() for word in KEYWORDS.get(app.env.docname, "").split(",") if word]
    if words:
        doctree.insert(0, index(entries=[("single", word, "", "main", None) for word in words]))


def every_page(app, env):
    """All pages are written at every build, since Sphinx forgets the entries of those that are not."""
    return list(env.all_docs)


def setup(app):
    app.connect("doctree-read", add)
    app.connect("env-updated", every_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
