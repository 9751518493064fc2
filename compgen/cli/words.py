"""Words of a command line as commands take them: typer converts with pydantic, which is as long to load as to correct.

A word that a command takes as it is needs no conversion, and an option that is not given has nothing to convert.
"""

from typing import Any

import typer


class _Taken:
    """In the place of typer's converter for a parameter, which is built when there is something to convert."""

    def __init__(self, parameter: Any) -> None:
        self._build = parameter.get_runtime_param
        self._kind = parameter.type_descriptor.annotation

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """What the command gets."""
        if value is None:
            return () if param.multiple or param.nargs == -1 else None
        if self._kind is str and isinstance(value, str):
            return value
        if self._kind == list[str] and isinstance(value, list | tuple) and all(isinstance(v, str) for v in value):
            return list(value)
        param._runtime_param = None
        return self._build().coerce(value, param=param, ctx=ctx)


def command(app: typer.Typer) -> Any:
    """The application, ready to be called; another release of typer may convert in its own way all the same."""
    found = typer.main.get_command(app)
    for one in (found, *getattr(found, "commands", {}).values()):
        for parameter in one.get_params(typer.Context(one)):
            if hasattr(parameter, "get_runtime_param") and hasattr(parameter, "type_descriptor"):
                parameter._runtime_param = _Taken(parameter)
    return found
