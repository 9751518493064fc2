"""Correct a program that exists: change only the numbers that are understood, prove the result from its text."""

from compgen.correction.result import Correction, Options
from compgen.correction.story import correct

__all__ = ["Correction", "Options", "correct"]
