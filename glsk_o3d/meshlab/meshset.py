"""MeshSet: MeshLab's, with our filters among its own."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..errors import GlskError, InvalidParameterError, did_you_mean
from . import builtin
from .meshset_layers import LayeredMeshSet, pymeshlab
from .recording import Recording, exact_digits
from .script import read_script
from .steps import Step, read_steps, step
from .verbs import Verb, verbs


class MeshSet(LayeredMeshSet):
    """``pymeshlab.MeshSet`` with the filters of this package among MeshLab's own.

    Ours are applied as MeshLab's are, by name or as methods, and can be mixed with them in filter scripts. Each makes a
    new layer from the current one, which becomes the current layer: a skeleton has vertices, edges, and the radii as
    vertex scalars. Where a layer came from one of our filters and its vertices and edges are as they were, the next one
    goes on from there; on any other layer the vertices are the cloud, and whatever must run first is run with its
    defaults.

    Lengths are ``pymeshlab.PercentageValue``, as MeshLab's own of the diagonal of the layer's bounding box, or
    ``pymeshlab.PureValue``, in the units of the cloud; a float and a string such as ``"2%"`` are understood too. What
    is not given is as elsewhere in this package, of the box that ``RingBuilder.frame`` names: ``"1% of the frame"``.

    Raises
    ------
    MissingPackageError
        When the class is imported and pymeshlab is not installed.

    Examples
    --------
    >>> import glsk_o3d as glsk
    >>> from glsk_o3d.samples import torus
    >>> meshes = glsk.MeshSet()
    >>> meshes.add_points(torus(1000).points)
    >>> result = meshes.generate_curve_skeleton_glsk(connector_radius="2%")
    >>> result["loops"], meshes.current_mesh().edge_number() == result["edges"]
    (1, True)
    """

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__(*args, **kwargs)
        self._script = Recording()

    # ----------------------------------------------------------------------------------------------------- filters

    def apply_filter(self, filter_name: str, **params: Any) -> dict[str, Any]:
        """Apply a filter of MeshLab's or ours to the current layer.

        Parameters
        ----------
        filter_name : str
            One of `filter_list`.
        **params
            See `print_filter_parameter_list`.

        Returns
        -------
        dict of str to object
            What the filter says about its result.

        Raises
        ------
        InvalidParameterError
            There is no such filter; or one of ours was given an unknown parameter or a wrong value.
        InvalidCloudError
            The layer cannot be skeletonised.
        pymeshlab.PyMeshLabException
            A filter of MeshLab's failed.
        """
        with self._script.following(self._numbers) as moved_to:
            if filter_name in verbs():
                params = _plain_lengths(params)
                if moved_to is not None and params.get("layer", -1) == -1:
                    params["layer"] = moved_to
                done = step(verbs()[filter_name], params)
                result, moved_to = self._run_ours(done), None
            elif filter_name in pymeshlab.filter_list():
                done, result = self._run_theirs(filter_name, params)
            else:
                raise InvalidParameterError(did_you_mean(str(filter_name), self.filter_list(), "filter"))
            self._script.add(done, moved_to)
        return result

    def _numbers(self) -> tuple[list[int], int]:
        """Those of all layers, and of the current one; -1 where there is none."""
        return sorted(mesh.id() for mesh in self), self.current_mesh_id() if self.mesh_number() else -1

    def apply_step(self, step: Step, on_iteration: Callable[..., Any] | None = None) -> dict[str, Any]:
        """Run a filter of a script without adding it to the current script.

        Parameters
        ----------
        step : Step
        on_iteration : callable, optional
            As in `glsk_o3d.skeletonize`.

        Returns
        -------
        dict of str to object

        Raises
        ------
        ScriptError
            The filter failed; the message names file and line.
        """
        with step.named_in_errors():
            if step.verb is not None:
                return self._run_ours(step, on_iteration)
            if step.goes_to is not None:
                if not self.mesh_id_exists(step.goes_to):
                    raise InvalidParameterError(f"mesh = {step.goes_to}: there is no such layer")
                self.set_current_mesh(step.goes_to)
                return {"layer": step.goes_to}
            try:
                return self._run_theirs(step.name, step.values)[1]
            except Exception as error:  # pymeshlab's have no base of their own
                raise GlskError(" ".join(str(error).split())) from error

    def _run_ours(self, step: Step, on_iteration=None) -> dict[str, Any]:
        verb = step.verb
        assert verb is not None
        layer = verb.run(self.layer(step.values.get("layer", -1)), step.values, on_iteration)
        self.add_mesh(layer.to_pymeshlab(), layer.label)
        self._flows = {number: known for number, known in self._flows.items() if self.mesh_id_exists(number)}
        self._flows[self.current_mesh_id()] = layer
        return {"layer": self.current_mesh_id(), **layer.summary()}

    def _run_theirs(self, name: str, params: dict[str, Any]) -> tuple[Step, dict[str, Any]]:
        asked: Any = super() if self.mesh_number() else builtin.trial()  # without a mesh it crashes
        exact = asked.filter_parameter_values(name, **params)
        for key, value in exact.items():
            if self.mesh_number() and builtin.is_layer(key, value) and not self.mesh_id_exists(value):
                raise InvalidParameterError(f"{key} = {value}: there is no such layer")
        super().clear_filter_script()
        result = super().apply_filter(name, **params)
        with tempfile.TemporaryDirectory() as folder:  # MeshLab alone knows how they are written
            file = os.path.join(folder, "last.mlx")
            super().save_filter_script(file)
            (call,) = read_script(file)
        return exact_digits(Step(name, dict(params), call), exact), result

    def filter_parameter_values(self, filter_name: str, **params: Any) -> dict[str, Any]:
        """The parameters that `apply_filter` would use: those given, and the defaults of the others.

        Parameters
        ----------
        filter_name : str
        **params

        Returns
        -------
        dict of str to object
        """
        if filter_name in verbs():
            return verbs()[filter_name].values(_plain_lengths(params))
        return super().filter_parameter_values(filter_name, **params)

    @staticmethod
    def filter_list() -> list[str]:
        """The names of all filters, MeshLab's and ours."""
        return [*pymeshlab.filter_list(), *verbs()]

    @staticmethod
    def print_filter_list() -> None:
        """Print the names of all filters, MeshLab's and ours."""
        print("\n".join(MeshSet.filter_list()))

    @staticmethod
    def print_filter_parameter_list(filter_name: str) -> None:
        """Print the parameters of a filter: name, type and default; of ours also limits and meaning.

        Parameters
        ----------
        filter_name : str
        """
        verb = verbs().get(filter_name)
        if verb is None:
            if filter_name not in pymeshlab.filter_list():
                raise InvalidParameterError(did_you_mean(filter_name, MeshSet.filter_list(), "filter"))
            pymeshlab.print_filter_parameter_list(filter_name)
            return
        print(f"{filter_name} filter - list of parameter names:")
        print("\n".join(_described(verb)) or "\tNone.")

    @staticmethod
    def search(word: str) -> None:
        """Print the filters, MeshLab's and ours, whose names or descriptions have a word.

        Parameters
        ----------
        word : str
        """
        for verb in verbs().values():
            if all(part in f"{verb.name} {verb.title} {verb.doc}".lower() for part in word.lower().split()):
                print(f"{verb.name} : {verb.doc}")
        pymeshlab.search(word)

    # ---------------------------------------------------------------------------------------------------- scripts

    def load_filter_script(self, filter_script_name: str | os.PathLike, *, any_filter: bool = False) -> None:
        """Make a script file the current script. Nothing is run; everything is checked.

        Parameters
        ----------
        filter_script_name : path-like
        any_filter : bool
            Take also filters of MeshLab's that write, read or send files, from a script that is trusted.

        Raises
        ------
        FileNotFoundError, FileFormatError, ScriptError
            See `glsk_o3d.meshlab.steps.read_steps`.
        """
        self._script.load(read_steps(filter_script_name, any_filter))

    def apply_filter_script(self) -> None:
        """Run the filters of the current script, in order, from the current layer on."""
        self._script.rerun()
        for each in self._script.steps:
            with self._script.following(self._numbers):
                self.apply_step(each)

    def save_filter_script(self, filter_script_name: str | os.PathLike) -> None:
        """Write the current script: what was loaded, and what was applied since. Our lengths in percent stay so.

        A filter that acted on another layer than the one that the filter before left does so again.

        Parameters
        ----------
        filter_script_name : path-like

        Raises
        ------
        ScriptError
            A filter acted on a layer that was added after the first filter, which no script can do.
        """
        self._script.save(filter_script_name)

    def clear_filter_script(self) -> None:
        """Make the current script empty."""
        self._script.clear()

    def clear(self) -> None:
        """Remove all layers. The current script stays."""
        super().clear()
        self._script.forget_layers()

    def print_filter_script(self) -> None:
        """Print the filters of the current script with their parameters."""
        print(self._script)


def _plain_lengths(params: dict[str, Any]) -> dict[str, Any]:
    """MeshLab's classes for lengths, which hold float32, as what our filters take."""

    def plain(value):
        if isinstance(value, pymeshlab.PercentageValue):
            return f"{np.float32(value.value())}%"
        return float(str(np.float32(value.value()))) if isinstance(value, pymeshlab.PureValue) else value

    return {name: plain(value) for name, value in params.items()}


def _described(verb: Verb) -> Iterator[str]:
    values = verb.values({})
    for slot in verb.slots.values():
        limits = {"above" if slot.facts["open_low"] else "min": slot.facts["low"], "max": slot.facts["high"]}
        limits = {key: limit for key, limit in limits.items() if limit is not None}
        said = f" [{'; '.join(f'{key}: {limit:g}' for key, limit in limits.items())}]" if limits else ""
        said += f" ({', '.join(slot.words)})" if slot.words else ""
        default = values.get(slot.name, "as the pipeline has it")
        yield f"\t{slot.name} : {slot.python_type()} = {default}{said}\n\t\t{slot.facts['doc']}"


def _method(name: str, verb: Verb):
    def apply(self, **params):
        return self.apply_filter(name, **params)

    apply.__name__ = name
    apply.__qualname__ = f"MeshSet.{name}"
    apply.__doc__ = f"{verb.doc}\n\nParameters: see ``MeshSet.print_filter_parameter_list({name!r})``.\n"
    return apply


for _name, _verb in verbs().items():
    setattr(MeshSet, _name, _method(_name, _verb))
