"""What every test may need: the project's folder, its path files, and a progress callback that says nothing."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
#: lines last as long as they are: hand formulas of ramps and speeds have no interpolation periods
EXACT = "robot.controller.rounds_up_to_period=false"


def path_file(name: str) -> str:
    return str(ROOT / "paths" / f"{name}.toml")


def quiet(stage: str, share: float) -> None:
    """A progress callback that says nothing."""
