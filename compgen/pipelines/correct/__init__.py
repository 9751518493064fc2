"""Correct a program that exists: change only the numbers that are understood, prove the result from its text."""

from compgen.pipelines.correct.correct import correct
from compgen.pipelines.correct.result import Correction, Options

__all__ = ["Correction", "Options", "correct"]
