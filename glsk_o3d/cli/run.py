"""``glsk run``: filter scripts."""

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from .console import echo, print_table, progress, value_in_words
from .options import CutLoops, argument, output_option
from .outputs import Output, check_outputs, print_result, write_outputs
from .reporting import WrongUsage


def run(
    script: Annotated[str | None, argument("SCRIPT", "A filter script (.mlx), or the name of one in --list.")] = None,
    scan: Annotated[Path | None, argument("SCAN", "The cloud or mesh it starts from.")] = None,
    output: Annotated[
        list[Path] | None, output_option("FILE", "The last layer: a skeleton, points or a mesh (ply, xyz).")
    ] = None,
    listed: Annotated[bool, Option("--list", help="List the scripts that come with the package.")] = False,
    cut_loops: CutLoops = False,
) -> None:
    """Run a MeshLab filter script, with MeshLab's filters and ours.

    The whole script is checked before anything is run. It needs pymeshlab.
    """
    from ..apps.meshlab.layers import layer_endings
    from ..apps.meshlab.script import comment, scripts
    from ..apps.meshlab.steps import find_script, read_steps

    if listed:
        docs = {name: comment(path) for name, path in scripts().items()}
        facts = [{"name": name, "doc": doc} for name, doc in docs.items()]
        print_result(facts, lambda: print_table(list(docs.items()), wrap=True))
        return
    if script is None or scan is None:
        raise WrongUsage("a SCRIPT and a SCAN are needed: glsk run SCRIPT SCAN -o FILE, or --list")
    from ..apps.meshlab.meshset import MeshSet

    steps = read_steps(find_script(script))
    makes = steps[-1].verb.makes if steps[-1].verb else "a skeleton, points or a mesh"
    measures = steps[-1].name.startswith("get_")  # a script that ends in a measurement needs no file

    def save(layers: Any, path: Path) -> None:
        layers.layer().save(path, cut_loops=cut_loops)

    outputs = [Output(path, layer_endings(makes), f"last layer is {makes}", save) for path in output or []]
    check_outputs(outputs, scan, needed=None if measures else "an output with -o")
    with progress() as update:
        update(f"reading {scan.name}")
        layers: Any = MeshSet()
        layers.load_scan(scan)
        results = []
        for i, step in enumerate(steps, 1):
            position = f"{i} of {len(steps)}: {step.call.name}"
            update(position)
            solve = f"{position}, solve {{0.iteration}}"
            result = layers.apply_step(step, lambda record, solve=solve: update(solve.format(record)))
            results.append({"filter": step.call.name, "result": _plain(result or {})})
        files = write_outputs(outputs, layers, update)

    def words() -> None:
        for i, step in enumerate(results, 1):
            facts = {name: value for name, value in step["result"].items() if name != "warnings"}
            echo(f"{i}. {step['filter']}: {value_in_words(facts)}".removesuffix(": "))

    print_result({"steps": results}, words, files)


def _plain(result: Any) -> Any:
    """What a filter says, without the classes of NumPy and pymeshlab."""
    if isinstance(result, dict):
        return {key: _plain(value) for key, value in result.items()}
    if isinstance(result, list | tuple):
        return tuple(map(_plain, result))
    if hasattr(result, "diagonal") and hasattr(result, "dim_x"):  # pymeshlab.BoundingBox
        return {name: _plain(getattr(result, name)()) for name in ("min", "max", "diagonal")}
    if hasattr(result, "tolist"):
        return _plain(result.tolist())
    return result if isinstance(result, bool | int | float | str | None) else str(result)
