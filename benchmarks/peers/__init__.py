"""Other libraries, each in a virtual environment of its own; one that cannot be installed is said to be missing."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
INSTALL, ANSWER = 900, 600  # s
PEERS = {
    "scipy": ["scipy"],
    "pinocchio": ["pin"],
    "roboticstoolbox": ["roboticstoolbox-python", "numpy<2"],
    "pybotics": ["pybotics"],
    "toppra": ["toppra"],
}


def ask(name: str, question: dict[str, Any], folder: Path) -> dict[str, Any] | str:
    """What a peer answers, or why it cannot."""
    place = folder / name
    python = place / "bin" / "python"
    mine = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    if not (place / "ready").exists():
        shutil.rmtree(place, ignore_errors=True)
        for call in (
            [sys.executable, "-m", "venv", str(place)],
            [str(python), "-m", "pip", "install", "-q", *PEERS[name]],
        ):
            try:
                done = subprocess.run(call, capture_output=True, text=True, timeout=INSTALL, check=False, env=mine)
            except (OSError, subprocess.TimeoutExpired) as failure:
                return f"not installed: {failure}"
            if done.returncode:
                return f"not installed: {_why(done.stderr)}"
        (place / "ready").touch()
    try:
        done = subprocess.run(
            [str(python), str(HERE / f"{name}_peer.py")],
            input=json.dumps(question), capture_output=True, text=True, timeout=ANSWER, check=False, env=mine,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as failure:
        return f"no answer: {failure}"
    if done.returncode:
        return f"failed: {_why(done.stderr)}"
    return dict(json.loads(done.stdout.splitlines()[-1]))


def _why(told: str) -> str:
    """The line that says what went wrong, fit for a table."""
    lines = [line.strip() for line in told.splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith("ERROR")]
    return ((errors or lines or ["no word"])[-1][:120]).replace("|", "/")
