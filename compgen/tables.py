"""Tables of a TOML file: classes whose annotations say what a key may hold, checked by pydantic's engine.

The engine takes its own description of a table, made here from the annotations. pydantic's classes around it make the
same one, but importing and building them takes longer than all that a short job computes.
"""

from collections.abc import Callable
from inspect import get_annotations
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Self, Union, get_args, get_origin

from pydantic_core import SchemaValidator

_PLAIN = {bool: "bool", int: "int", str: "str", float: "float", Any: "any"}
_NOTHING = object()  # the default of a key that must be there


def within(**limits: Any) -> tuple[tuple[str, Any], ...]:
    """What a value must keep beside its type: ge, gt, le, lt, min_length, max_length, pattern."""
    return tuple(limits.items())


FiniteFloat = Annotated[float, within(allow_inf_nan=False)]


class Table:
    """A TOML table: unknown keys are refused, numbers are numbers.

    An annotation with a value is a key that may be left out; a name that Python keeps for itself ends in ``_``.
    """

    __slots__ = ("__dict__", "__pydantic_extra__", "__pydantic_fields_set__", "__pydantic_private__")

    def __init__(self, **values: Any) -> None:
        validator(type(self)).validate_python(values, self_instance=self)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__}.{name} is fixed")

    def replaced(self, **changes: Any) -> Self:
        """The same with other values, unchecked."""
        new = object.__new__(type(self))
        for name, value in (("__dict__", {**vars(self), **changes}), ("__pydantic_fields_set__", told(self))):
            object.__setattr__(new, name, value)
        return new


def told(table: Table) -> set[str]:
    """The names of the keys that the file has itself."""
    return set(table.__pydantic_fields_set__)  # type: ignore[attr-defined]


def keys_of(table: type[Table]) -> dict[str, tuple[str, Any]]:
    """Each key's name in Python, and its annotation."""
    found = {}
    for base in reversed(table.__mro__):
        for name, annotation in get_annotations(base).items():
            found[name.rstrip("_")] = (name, annotation)
    return found


def validator(table: type[Table]) -> SchemaValidator:
    """What checks a table and makes it of plain values."""
    if table not in _MADE:
        _MADE[table] = SchemaValidator(_table(table))
    return _MADE[table]


_MADE: dict[type[Table], SchemaValidator] = {}


def _table(table: type[Table]) -> dict[str, Any]:
    fields = {}
    for key, (name, annotation) in keys_of(table).items():
        value = described(annotation)
        default = getattr(table, name, _NOTHING)
        if default is not _NOTHING:
            value = {"type": "default", "schema": value, "default": default}
        fields[name] = {"type": "model-field", "schema": value}
        if key != name:
            fields[name]["validation_alias"] = key
    return {
        "type": "model",
        "cls": table,
        "schema": {"type": "model-fields", "fields": fields, "model_name": table.__name__},
        "config": {"title": table.__name__, "strict": True, "extra_fields_behavior": "forbid"},
    }


def described(annotation: Any) -> dict[str, Any]:
    """What the engine is told of an annotation."""
    if annotation in _PLAIN:
        return {"type": _PLAIN[annotation]}
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return _table(annotation)
    kind = get_origin(annotation)
    parts = (annotation.__origin__, *annotation.__metadata__) if kind is Annotated else get_args(annotation)
    return _KINDS[kind](*parts)


def _limited(inner: Any, *limits: tuple[tuple[str, Any], ...]) -> dict[str, Any]:
    found = described(inner)
    for more in limits:
        found |= dict(more)
    return found


def _either(*choices: Any) -> dict[str, Any]:
    some = [described(c) for c in choices if c is not NoneType]
    found = some[0] if len(some) == 1 else {"type": "union", "choices": some}
    return {"type": "nullable", "schema": found} if NoneType in choices else found


_KINDS: dict[Any, Callable[..., dict[str, Any]]] = {
    Annotated: _limited,
    Literal: lambda *expected: {"type": "literal", "expected": list(expected)},
    Union: _either,
    UnionType: _either,
    dict: lambda key, value: {"type": "dict", "keys_schema": described(key), "values_schema": described(value)},
    list: lambda item: {"type": "list", "items_schema": described(item)},
}
