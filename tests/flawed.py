"""The study's robot with every error source, as a file and as a cell."""

from pathlib import Path

from shipped import ROOT

from compgen.error_model.sources import ORDER

SOURCES = Path(__file__).parent / "flawed_sources.toml"
COUNT = len(ORDER) + 2  # each source once, the measured map for each axis of World


def flawed_file(folder: Path, name: str = "flawed", drop: tuple[str, ...] = ()) -> str:
    """Writes the robot file with all sources (but the tables dropped) into a folder."""
    nominal = (ROOT / "robots" / "m710ic50.toml").read_text()
    cte = "cte_um_m_K = 11.25"
    assert cte in nominal
    nominal = nominal.replace(cte, "cte_um_m_K = { d1 = 10.5, a2 = 11.25, a3 = 12, d4 = 11.25, d6 = 11.5 }")
    tables = SOURCES.read_text().split("\n\n")
    kept = [t for t in tables if not any(t.lstrip().startswith((f"[sources.{d}]", f"[[sources.{d}]]")) for d in drop)]
    assert len(kept) < len(tables) or not drop
    file = folder / f"{name}.toml"
    file.write_text(nominal + "\n" + "\n\n".join(kept))
    return str(file)


#: overrides: a few errors of the arm, each known with a sigma
KNOWN_WITH_SIGMAS = (
    "robot.sources.link_offsets.a_um=[0, 50, 0, 0, 0, 0]",
    "robot.sources.link_offsets.sigma.a_um=[0, 12, 5, 0, 0, 0]",
    "robot.sources.joint_zeros.offset_mdeg=[5, 0, 0, 0, 0, 0]",
    "robot.sources.joint_zeros.sigma.offset_mdeg=[0, 1, 1, 0, 2, 0]",
    "robot.sources.hysteresis.backlash_mdeg=[4, 3, 2, 0, 0, 0]",
    "robot.sources.hysteresis.width_mdeg=[90, 90, 90, 90, 90, 90]",
    "robot.sources.hysteresis.sigma.backlash_mdeg=[1, 1, 1, 0, 0, 0]",
)
