"""What is built for an owner lives as long as the owner: functions of a model end with the model.

The owner is held weakly, so what is built must not refer to it. A long-lived owner keeps the last few only.
"""

import inspect
from collections import OrderedDict
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar, cast
from weakref import WeakKeyDictionary

KEPT = 16  # results for each owner
_ABSENT = object()

P = ParamSpec("P")
R = TypeVar("R")


def kept_with(owner: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Keep what a function returns while one of its arguments lives, for its other arguments.

    Args:
        owner: The argument's name; an object that can be referred to weakly and is equal to itself only.

    Returns:
        A decorator of functions with hashable arguments; the owner is a positional one. An argument that has a
        ``content``, as a pose, is the same as another of equal content.
    """

    def decorate(build: Callable[P, R]) -> Callable[P, R]:
        place = list(inspect.signature(build).parameters).index(owner)
        kept: WeakKeyDictionary[Any, OrderedDict[tuple[object, ...], Any]] = WeakKeyDictionary()

        @wraps(build)
        def get(*args: P.args, **kwargs: P.kwargs) -> R:
            results = kept.setdefault(args[place], OrderedDict())
            others = (*args[:place], *args[place + 1 :], *sorted(kwargs.items()))
            key = tuple(getattr(argument, "content", argument) for argument in others)
            result = results.get(key, _ABSENT)
            if result is _ABSENT:
                result = results[key] = build(*args, **kwargs)
                if len(results) > KEPT:
                    results.popitem(last=False)
            return cast(R, result)

        return get

    return decorate
