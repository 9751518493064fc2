"""Writes the table of docs/motion.md: what a controller's motion leaves of paths, at feeds, known and not.

python docs/motion.py
"""

from pathlib import Path

from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate

HERE = Path(__file__).parent
ROOT = HERE.parent
PATHS = ("circle_1300", "spiral_1300")
FEEDS = (20, 100, 200)  # mm/s
IDENTIFIED = 'robot.motion.identified={robot="m710ic50", verdict="accepted", runs_began="both"}'
EXACT = "robot.controller.rounds_up_to_period=false"
CONTROLLERS = {
    "ideal": [EXACT],
    "0.1 s": [EXACT, "robot.motion.moving_average_ms=[100]"],
    "0.2 + 0.1 s": [EXACT, "robot.motion.moving_average_ms=[200, 100]"],
    "rounds up": ["robot.controller.rounds_up_to_period=true"],
}
IN_TABLE = ("ideal", "0.1 s", "0.2 + 0.1 s")  # rounding up alone is as ideal: the page says so
BEGIN, END = "<!-- begin: python docs/motion.py -->\n", "<!-- end -->\n"
HEAD = f"| path | feed [mm/s] | {' | '.join(IN_TABLE)} |\n|---|---|{'---|' * len(IN_TABLE)}\n"


def sizes(name: str, feed: int, controller: str) -> tuple[float, float, float]:
    """Largest error on the part [um]: uncorrected, corrected without knowing the motion, and knowing it."""
    overrides = [f"process.feed_mm_s={feed}", *CONTROLLERS[controller]]
    smooth = "motion" in "".join(overrides)
    before, left = _errors(name, [*overrides, IDENTIFIED] if smooth else overrides)
    known = _errors(name, [*overrides, IDENTIFIED, "robot.motion.enabled=true"])[1] if smooth else left
    return before, left, known


def cell(name: str, feed: int, controller: str) -> str:
    """The three sizes as the table has them."""
    before, left, known = sizes(name, feed, controller)
    return f"{before:.0f}, {left:.1f}, {known:.1f}"


def _errors(name: str, overrides: list[str]) -> tuple[float, float]:
    """Largest error on the part before and after [um], on a twin whose controller the overrides describe."""
    job = load_job(str(ROOT / "paths" / f"{name}.toml"), None, overrides)
    planned, corrected = generate.generate(job, lambda stage, share: None)
    return planned.deviation().on_part["total"].max / UM, corrected.deviation.on_part["total"].max / UM


def main() -> None:
    """Lay the table anew."""
    page = (HERE / "motion.md").read_text()
    begin, end = page.index(BEGIN) + len(BEGIN), page.index(END)
    rows = "".join(
        f"| `{name}` | {feed} | {' | '.join(cell(name, feed, controller) for controller in IN_TABLE)} |\n"
        for name in PATHS
        for feed in FEEDS
    )
    (HERE / "motion.md").write_text(page[:begin] + HEAD + rows + page[end:])


if __name__ == "__main__":
    main()
