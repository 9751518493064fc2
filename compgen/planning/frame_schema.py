"""Table of a path file, and of a file of its own, for the frame that the part stands in."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from compgen.core.toml import Angle, Coordinate, NotNegative, Table

Rise = Annotated[FiniteFloat, Field(ge=-100, le=200)]
Three = Annotated[list[NotNegative], Field(min_length=3, max_length=3)]


class TaughtTable(Table):
    """How a frame was taught: by which arm, how warm it was, and how well its place is known."""

    through: Literal["model", "pendant"]
    """By the robot file's model of the warm arm (cgen teach-frame), or as the pendant shows positions."""
    robot_file: str = ""
    """Name and hash of the robot file whose model it was."""
    rise_K: dict[str, Rise] = {}
    """Largest rise of each node of the arm while it was taught; none: cold."""
    sigma_um: Three = [0.0, 0.0, 0.0]
    """Standard deviation of the part's place along World's axes, in the middle of what was touched."""
    sigma_mdeg: Three = [0.0, 0.0, 0.0]
    """Standard deviation of the part's orientation about World's axes."""


class FrameTable(Table):
    """Frame that the part stands in: the path is given in it, and the program is written in this user frame."""

    number: Annotated[int, Field(ge=1, le=9)] | None = None
    """UFRAME number on the controller; default 1, or the file's."""
    file: str | None = None
    """File beside this one with the frame, instead of numbers: of cgen teach-frame, or SYSFRAME.VA."""
    x_mm: Coordinate = 0.0
    """Origin in World, x."""
    y_mm: Coordinate = 0.0
    """Origin in World, y."""
    z_mm: Coordinate = 0.0
    """Origin in World, z."""
    w_deg: Angle = 0.0
    """Rotation about World's x."""
    p_deg: Angle = 0.0
    """Rotation about World's y."""
    r_deg: Angle = 0.0
    """Rotation about World's z."""
    taught: TaughtTable | None = None
    """How it was taught."""


class TaughtToolTable(Table):
    """Tool that a frame was taught with: the probe's centre in the flange."""

    x_mm: Coordinate
    """Place in the flange, x."""
    y_mm: Coordinate
    """Place in the flange, y."""
    z_mm: Coordinate
    """Place in the flange, z."""
    sigma_um: Three = [0.0, 0.0, 0.0]
    """Its standard deviation."""


class FrameFile(Table):
    """What cgen teach-frame writes."""

    frame: FrameTable
    tool: TaughtToolTable | None = None
    """Probe that touched, as the touches say."""
