"""Values that follow from others are computed once, and kept while those that they follow from stay the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import cached_property
from typing import Any, TypeVar

Self = TypeVar("Self", bound="Changeable")
Value = TypeVar("Value")


class Derived(cached_property[Value]):
    """A property that is computed once, from some fields."""

    fields: tuple[str, ...] = ()


def derived(*fields: str) -> Callable[[Callable[[Any], Value]], Derived[Value]]:
    """Decorator of a method without arguments: its value is computed once, and depends on these fields alone."""

    def decorate(method: Callable[[Any], Value]) -> Derived[Value]:
        fact = Derived(method)
        fact.fields = fields
        return fact

    return decorate


class Changeable:
    """Base of frozen dataclasses that are changed by making another one."""

    def changed(self: Self, **fields: Any) -> Self:
        """The same with other values of some fields; derived values that do not depend on these are kept."""
        other, known = replace(self, **fields), vars(self)  # type: ignore[type-var]
        for name in known.keys() - vars(other).keys():
            fact = getattr(type(self), name, None)
            if isinstance(fact, Derived) and not set(fact.fields) & fields.keys():
                vars(other)[name] = known[name]
        return other


def forget(value: Any, field: str) -> None:
    """Let an instance compute anew what depends on a field."""
    for name in [*vars(value)]:
        fact = getattr(type(value), name, None)
        if isinstance(fact, Derived) and field in fact.fields:
            del vars(value)[name]


def fields_of(value: Any, cls: type[Any]) -> dict[str, Any]:
    """The fields that a value has as an instance of a dataclass, for one that shares them."""
    return {field.name: getattr(value, field.name) for field in fields(cls)}
