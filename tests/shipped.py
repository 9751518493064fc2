"""What every test may need: the project's folder, its path files, and a progress callback that says nothing."""

import pkgutil
from importlib import import_module
from pathlib import Path

import compgen

ROOT = Path(__file__).parents[1]
#: lines last as long as they are: hand formulas of ramps and speeds have no interpolation periods
EXACT = "robot.controller.rounds_up_to_period=false"


def path_file(name: str) -> str:
    return str(ROOT / "paths" / f"{name}.toml")


def quiet(stage: str, share: float) -> None:
    """A progress callback that says nothing."""


def load_everything() -> None:
    """Import all of compgen, and what its commands import when they are called."""
    for module in pkgutil.walk_packages(compgen.__path__, "compgen."):
        if not module.name.endswith("__main__"):
            import_module(module.name)
    for name in ("casadi", "pinocchio", "ruckig", "plotly.graph_objects", "plotly.offline", "scipy.interpolate"):
        import_module(name)
