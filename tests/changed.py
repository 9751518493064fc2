"""A copy of a tree of frozen data with another value at one place."""

from dataclasses import replace


def changed(owner, key, value):
    """``changed(job, "plan.process.feed", 0.1)``."""
    first, _, inner = key.partition(".")
    return replace(owner, **{first: changed(getattr(owner, first), inner, value) if inner else value})
