"""What all our filters for MeshLab have in common: a name, parameters, and a new layer for a result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import InvalidParameterError, did_you_mean
from .layers import Layer
from .slots import Slot

WHOLE, SEGMENTED = "generate_curve_skeleton", "generate_segmented_cloud"


@dataclass(frozen=True)
class Verb:
    """One of our filters for MeshLab.

    Attributes
    ----------
    name : str
        In Python: ``"generate_curve_skeleton_glsk"``.
    title : str
        In scripts: ``"Generate Curve Skeleton (GLSkeleton)"``.
    doc : str
    slots : dict of str to Slot
    """

    name: str
    title: str
    doc: str
    slots: dict[str, Slot]

    @property
    def makes(self) -> str:
        """What the result may be, as `check_ending` has it."""
        return "skeleton"

    def checked(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """The given parameters as they are taken; InvalidParameterError for a name or a value that is wrong."""
        made = {}
        for name, value in values.items():
            if name not in self.slots:
                raise InvalidParameterError(did_you_mean(name, self.slots, f"parameter of {self.name}"))
            try:
                made[name] = self.slots[name].checked(value)
            except ValueError as error:
                raise InvalidParameterError(f"{name} = {value!r}: {error}") from None
        return made

    def plan(self, values: Mapping[str, Any]) -> Any:
        """What the verb does with such parameters, all checked; two of the same are equal.

        Raises
        ------
        InvalidParameterError
            An unknown parameter (the message names the nearest), or a value of the wrong type or out of range.
        """
        raise NotImplementedError

    def values(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """All parameters that matter, the given ones and the defaults of the others."""
        made = self.checked(given)
        return {name: made.get(name, slot.default) for name, slot in self.slots.items()}

    def run(self, layer: Layer, given: Mapping[str, Any], on_iteration: Callable[..., Any] | None = None) -> Layer:
        """Run on a layer.

        Parameters
        ----------
        layer : Layer
        given : mapping of str to object
            Parameters that differ from the defaults. Percentages are of the diagonal of the layer's bounding box.
        on_iteration : callable, optional
            As in `glsk_o3d.skeletonize`.

        Returns
        -------
        Layer

        Raises
        ------
        InvalidParameterError, InvalidCloudError
        """
        raise NotImplementedError

    def shown(self, result: Any, source: Layer) -> Layer:
        """The layer that shows a result."""
        return Layer.of(result, f"{self.title.partition(' (')[0].partition(' ')[2]} of {source.label}", source)


def called(stem: str) -> tuple[str, str]:
    """Name and title of a verb."""
    return f"{stem}_glsk", f"{stem.replace('_', ' ').title()} (GLSkeleton)"
