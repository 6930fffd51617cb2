"""What readers search for and the page that they want: entries of an index that only the search uses. Gallery links."""

import re

from sphinx.addnodes import index

KEYWORDS = {
    "docs/start": "start, tutorial, quick start, getting started, install, installation",
    "docs/method": "method, algorithm, how it works, laplacian, contraction, equations",
    "docs/parameters": (
        "parameters, settings, options, tuning, report, warning, warnings, confidence, decisions, support"
    ),
    "docs/troubleshooting": (
        "troubleshooting, wrong, failure, failures, fails, limits, limitations, noise, noisy, sparse, "
        "radius, slow, stop reason, sphere, sheet"
    ),
    "docs/coming_from": "matlab, cloudcontr, migration, coming from, pc-skeletor, skeletor, cgal",
    "docs/open3d": "open3d, annotate, attributes, colours, colors, tubes, tensor, downsample, point reduction",
    "docs/curve": (
        "nearest, distance, arc length, path, geodesic, tangent, frame, curvature, section, cross-section, "
        "resample, smooth, transform, scale"
    ),
    "docs/branches": (
        "branch, branches, segmentation, segment, label, labels, length, edit, editing, detail, prune, "
        "simplify, reroot, cut loops, convert"
    ),
    "docs/trees": "tree, trees, plant, plants, forestry, forest, qsm, treeqsm, cylinders, volume, dbh, stem, crown",
    "docs/grasping": "grasp, grasps, grasping, gripper, manipulation, pick, picking",
    "docs/robots": (
        "robot, robots, ros, ros2, ros 2, urdf, bag, rosbag, node, depth camera, depth image, rgb-d, rgbd, "
        "realsense, kinect, flying pixels, mixed pixels"
    ),
    "docs/tracking": (
        "track, tracking, tracker, time, frames, video, growth, growing, phenotyping, identity, registration, "
        "icp, motion, change"
    ),
    "docs/meshlab": "meshlab, pymeshlab, mlx, filter script, filter scripts",
    "docs/batch": "batch, parallel, cluster, shard, tiles, ledger, many clouds, many scans, large clouds, memory",
    "docs/formats": (
        "format, formats, file, files, save, read, load, export, las, laz, e57, ply, swc, gltf, csv, "
        "units, rig, armature, view, viewer, plot, preview, notebook, picture, html, window, "
        "visualization, visualisation"
    ),
    "docs/plugins": (
        "plugin, plugins, entry points, own filter, extend, custom filter, recipe, recipes, reproducible, "
        "repeat, json, pipeline"
    ),
    "docs/speed": "speed, fast, performance, time, runtime, memory use, scaling",
    "docs/comparison": "comparison, compare, other tools, pygel3d, versus, alternatives",
    "docs/benchmark": "benchmark, benchmarks, score, scores",
    "docs/evaluation": "evaluate, evaluation, measures, metrics, truth, assess, accuracy, accurate, error",
    "docs/crosscheck": "crosscheck, cross-check, libigl, mesh, Poisson, genus, eigenvalues, verdict, trust",
    "docs/differences": (
        "differences, published code, paper, publication, novelty, ablation, references, bibliography, "
        "citations, literature"
    ),
    "docs/filters/index": "filter, filters, numbers, constants, thresholds, defaults",
    "docs/filters/sampler": "sampler, sample, sampling, nan, duplicates",
    "docs/filters/outlier_remover": "outlier remover, outlierremover, outliers, outlier, lof",
    "docs/filters/denoiser": "denoiser, denoise, denoising, ridge, mean shift",
    "docs/filters/thinner": "thinner, thin, thinning, too many points",
    "docs/filters/ring_builder": "ring builder, ringbuilder, rings, one-ring, neighbours, neighbors",
    "docs/filters/contractor": "contractor, solver, weights",
    "docs/filters/lpr_reducer": "lpr reducer, lprreducer, lpr, reducer, reduction, local point reduction",
    "docs/filters/connector": "connector, connect, graph",
    "docs/filters/refiner": "refiner, refine, refinement, loops, loop, handles, spurs, gaps, bridge, air, empty space",
    "docs/filters/tracer": "tracer, trace, traced, twigs, sparse tree",
    "docs/filters/stopping": "stopping, stop, stopping rules, convergence",
    "docs/conventions": "conventions, frame, sign, coordinates, georeferenced, glossary, terms, words",
    "docs/architecture": "architecture, modules, imports, design",
    "docs/generated/api/index": "api, api reference, functions, classes",
    "docs/generated/gallery/index": "gallery, examples, example, scripts",
    "CONTRIBUTING": "contributing, contribute, development, tests, style, release, releases, releasing",
    "CHANGELOG": "changelog, changes, versions, what is new",
}
"""Words by page; each word leads to one page. Options of filters lead to their own place by themselves."""


def add(app, doctree):
    """Entries of the whole page."""
    words = [word.strip() for word in KEYWORDS.get(app.env.docname, "").split(",") if word]
    if words:
        doctree.insert(0, index(entries=[("single", word, "", "main", None) for word in words]))


def every_page(app, env):
    """All pages are written at every build, because Sphinx forgets the entries of those that are not."""
    return list(env.all_docs)


def link_gallery(app, docname, source):
    """On GitHub a link into the gallery opens a script; here it leads to the page with its pictures."""
    folder = "../" * docname.count("/") + "docs/generated/gallery/"
    text = source[0].replace("](gallery/README.rst)", f"]({folder}index.rst)")
    source[0] = re.sub(r"\]\(gallery/(plot_\w+)\.py\)", rf"]({folder}\1.rst)", text)


def setup(app):
    app.connect("source-read", link_gallery)
    app.connect("doctree-read", add)
    app.connect("env-updated", every_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
