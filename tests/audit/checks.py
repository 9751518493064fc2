"""Rows of the audit's table."""

from typing import NamedTuple

import numpy as np


class Check(NamedTuple):
    """What, the audit's number, the output's, how far they are apart, and how far they may be."""

    what: str
    audit: float
    output: float
    apart: float
    allowed: float

    @property
    def kept(self):
        """Whether they agree; a NaN does not."""
        return bool(self.apart <= self.allowed)


def count(what, wrong):
    """How many are wrong, of which none may be."""
    return Check(what, 0, int(wrong), int(wrong), 0)


def below(what, value, limit, allowed):
    """A value that the audit finds under a limit that was promised."""
    return Check(what, value, limit, value - limit, allowed)


def equal(what, own, written, allowed):
    """Two numbers, or the pair of two arrays that are farthest apart."""
    own, written = np.atleast_1d(np.asarray(own, dtype=float)), np.atleast_1d(np.asarray(written, dtype=float))
    apart = np.abs(own - written)
    worst = np.unravel_index(int(np.argmax(np.where(np.isnan(apart), np.inf, apart))), apart.shape)
    return Check(what, float(own[worst]), float(written[worst]), float(apart[worst]), allowed)
