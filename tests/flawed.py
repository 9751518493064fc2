"""The study's robot with every error source, as a file and as a cell."""

from pathlib import Path

from shipped import ROOT

SOURCES = Path(__file__).parent / "flawed_sources.toml"


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
