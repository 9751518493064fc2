"""Bounded values that several tables of a file hold; their upper ends are far beyond any cell.

They keep a slip of the keyboard from becoming a number that overflows.
"""

from typing import Annotated

from pydantic import Field, FiniteFloat

Number = Annotated[FiniteFloat, Field(ge=-1e6, le=1e6)]
Positive = Annotated[FiniteFloat, Field(gt=0, le=1e6)]
NotNegative = Annotated[FiniteFloat, Field(ge=0, le=1e6)]
Length = Annotated[FiniteFloat, Field(gt=0, le=1e4)]  # mm
Coordinate = Annotated[FiniteFloat, Field(ge=-1e4, le=1e4)]  # mm
Angle = Annotated[FiniteFloat, Field(ge=-3600, le=3600)]  # deg
Identifier = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=16)]
Point = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
Range = Annotated[list[Number], Field(min_length=2, max_length=2)]
AngleRange = Annotated[list[Angle], Field(min_length=2, max_length=2)]
SixCoordinates = Annotated[list[Coordinate], Field(min_length=6, max_length=6)]
SixAngles = Annotated[list[Angle], Field(min_length=6, max_length=6)]
SixFactors = Annotated[list[Annotated[FiniteFloat, Field(ge=-10, le=10)]], Field(min_length=6, max_length=6)]
SixRates = Annotated[list[Annotated[FiniteFloat, Field(ge=1e-3, le=1e6)]], Field(min_length=6, max_length=6)]
