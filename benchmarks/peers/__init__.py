"""Other libraries, each in a virtual environment of its own; one that cannot be installed is said to be missing."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PEERS = {
    "roboticstoolbox": ["roboticstoolbox-python", "numpy<2"],
    "pybotics": ["pybotics"],
    "toppra": ["toppra"],
}


def ask(name: str, question: dict[str, Any], folder: Path) -> dict[str, float] | str:
    """What a peer answers, or why it cannot."""
    place = folder / name
    python = place / "bin" / "python"
    if not (place / "ready").exists():
        for call in (
            [sys.executable, "-m", "venv", str(place)],
            [str(python), "-m", "pip", "install", "-q", *PEERS[name]],
        ):
            try:
                done = subprocess.run(call, capture_output=True, text=True, timeout=900, check=False)
            except (OSError, subprocess.TimeoutExpired) as failure:
                return f"not installed: {failure}"
            if done.returncode:
                return f"not installed: {(done.stderr.strip().splitlines() or ['pip failed'])[-1][:120]}"
        (place / "ready").touch()
    script = HERE / f"{name}_peer.py"
    try:
        done = subprocess.run(
            [str(python), str(script)],
            input=json.dumps(question),
            capture_output=True,
            text=True,
            timeout=1800,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return "did not finish in 30 minutes"
    if done.returncode:
        return f"failed: {(done.stderr.strip().splitlines() or ['no word'])[-1][:120]}"
    return dict(json.loads(done.stdout.splitlines()[-1]))
