"""The exceptions that compgen raises. An *error* is metres; an *exception* is Python."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import degrees
from typing import Any

from compgen.core.exit_codes import ExitCode
from compgen.core.units import MM

RESULT = "a result", "make another one"


class CompgenError(Exception):
    """Anything compgen refuses to do; ``exit_code`` is what the command line returns."""

    exit_code = ExitCode.BAD_INPUT


class InputError(CompgenError):
    """Bad input: names the file, the key or line, the value, and the mend."""


class TableError(InputError):
    """A table of a file is not what it can be: a key, or its value alone, is wrong whatever else the file says."""


class ShapeError(InputError, ValueError):
    """An array of another shape than its place has."""


class FrozenError(InputError, AttributeError):
    """Something that does not change once it is made was to be changed."""


class ImpossibleError(CompgenError):
    """The job cannot be done by this robot: names the waypoint, the joint and the distance."""

    exit_code = ExitCode.IMPOSSIBLE


class UnreachableError(ImpossibleError):
    """A waypoint lies outside the reach of the arm; place of the flange and distance [m]."""

    def __init__(self, waypoint: int, position: tuple[float, float, float], distance: float, side: str) -> None:
        self.waypoint, self.position, self.distance, self.side = waypoint, position, distance, side
        x, y, z = (v / MM for v in position)
        super().__init__(
            f"waypoint {waypoint} (flange at X {x:.1f} Y {y:.1f} Z {z:.1f} mm) is out of reach: the wrist centre is "
            f"{_millimetres(distance)} mm {side} of joint 3; move the path or make it smaller"
        )


class JointLimitError(ImpossibleError):
    """A waypoint needs a joint angle beyond its limit; value and limits [rad]."""

    def __init__(self, waypoint: int, joint: str, value: float, lower: float, upper: float, posture: str = "") -> None:
        self.waypoint, self.joint, self.value, self.lower, self.upper = waypoint, joint, value, lower, upper
        excess = max(lower - value, value - upper)
        super().__init__(
            f"waypoint {waypoint}: joint {joint} needs {_deg(value)}, {degrees(excess):.3g} deg beyond its "
            f"limits {_deg(lower)} to {_deg(upper)}{posture}; move the path, or choose another posture"
        )


class InterferenceError(ImpossibleError):
    """A waypoint, or the way to it, has J2 and J3 where the arm hits itself; angles [rad]."""

    def __init__(self, waypoint: int, j2: float, j3: float, depth: float) -> None:
        self.waypoint, self.j2, self.j3, self.depth = waypoint, j2, j3, depth
        far = f"{degrees(depth):.3g} deg outside" if depth > 0 else "on a way that passes outside"
        super().__init__(
            f"waypoint {waypoint}: J2 = {_deg(j2)} with J3 = {_deg(j3)} is {far} the polygon "
            "limits.interference.j2_j3_deg, where the arm hits itself; move the path, or choose another posture"
        )


class SingularityError(ImpossibleError):
    """A waypoint, or the way to it, passes a singularity of the arm."""

    def __init__(self, waypoint: int, joint: str, kind: str, distance: str, limit: str) -> None:
        self.waypoint, self.joint, self.kind, self.distance = waypoint, joint, kind, distance
        super().__init__(
            f"waypoint {waypoint}: the path passes the {kind} singularity (joint {joint}) at {distance}, "
            f"closer than {limit}; move the path away from it"
        )


def refuse_changes(owner: type[object], what: str, mend: str) -> None:
    """Let setting or deleting an attribute of a frozen dataclass raise FrozenError, an InputError.

    Args:
        owner: The class.
        what: It is, with its article.
        mend: What to do instead.
    """

    def refuse(self: Any, name: str, *value: object) -> None:
        raise FrozenError(f"{type(self).__name__}.{name}: {what} does not change; {mend}")

    owner.__setattr__ = owner.__delattr__ = refuse  # type: ignore[method-assign]


@contextmanager
def naming_file(file: str) -> Iterator[None]:
    """Put a file's name before what is refused of it, where the message does not begin with it."""
    try:
        yield
    except CompgenError as failure:
        if not str(failure).startswith(f"{file}: "):
            failure.args = (f"{file}: {failure}",)
        raise


def _millimetres(distance: float) -> str:
    return f"{distance / MM:.0f}" if distance >= 100 * MM else f"{distance / MM:.3g}"


def _deg(angle: float) -> str:
    return f"{degrees(angle):.3f} deg"
