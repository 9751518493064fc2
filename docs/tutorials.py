"""Runs the tutorials in docs/tutorials/, each in an empty folder, and lays their outputs and pictures anew.

python docs/tutorials.py [NAME]

A tutorial is read from top to bottom: each block of commands (`sh`) goes to one bash, and the block of output (`text`)
right after it shows what came. A line `[...]` in an output stands for lines left out; the others keep their place when
an output is laid anew. Pictures are drawn by docs/tutorial_pictures.py from the files that the commands leave.
"""

import difflib
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
FOLDER = HERE / "tutorials"
STEP = re.compile(r"^```sh\n(?P<commands>.*?)^```\n(?:\n```text\n(?P<output>.*?)^```\n)?", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.]*\w)")
LEFT_OUT = "[...]"
BETWEEN = "\x1e"


@dataclass(frozen=True)
class Step:
    """Commands of a tutorial, and the output that the page shows for them; none where it shows nothing."""

    commands: str
    output: str | None


def pages() -> list[Path]:
    """All tutorials: the pages with commands."""
    return [page for page in sorted(FOLDER.glob("*.md")) if STEP.search(page.read_text())]


def steps(text: str) -> list[Step]:
    """The steps of a page, in order."""
    return [Step(match["commands"], match["output"]) for match in STEP.finditer(text)]


def run(text: str, folder: Path) -> list[str]:
    """What each step of a page prints, run by one bash in ``folder`` with this Python's package as ``cgen``.

    Raises:
        RuntimeError: A command failed; those that shall fail are followed by ``||``.
    """
    with tempfile.TemporaryDirectory() as programs:
        cgen = Path(programs) / "cgen"
        cgen.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m compgen "$@"\n')
        cgen.chmod(0o755)
        environment = {key: value for key, value in os.environ.items() if key != "COLUMNS"}
        environment |= {
            "PATH": os.pathsep.join([programs, os.environ["PATH"]]),
            "PYTHONPATH": str(HERE.parent),
            "LC_ALL": "C.UTF-8",
            "PYTHONUNBUFFERED": "1",  # output and refusals in the order of a terminal
        }
        script = f"printf '{BETWEEN}'\n".join(step.commands for step in steps(text))
        done = subprocess.run(
            ["bash", "--norc", "-e", "-c", script],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
    outputs = done.stdout.split(BETWEEN)
    if done.returncode or len(outputs) != len(steps(text)):
        raise RuntimeError(f"exit {done.returncode} after step {len(outputs)} of {len(steps(text))}:\n{outputs[-1]}")
    return outputs


def parts(output: str) -> list[list[str]]:
    """The lines that an output shows, in runs between the places where lines are left out."""
    runs: list[list[str]] = [[]]
    for line in output.splitlines():
        if line.strip() == LEFT_OUT:
            runs.append([])
        else:
            runs[-1].append(line.rstrip())
    return runs


def same_line(shown: str, now: str) -> bool:
    """Whether a line reads the same, decimals within one unit of their last place: other processors round otherwise."""
    shown, now = (" ".join(line.split()) for line in (shown, now))  # columns are as wide as lines left out make them
    if NUMBER.sub("#", shown) != NUMBER.sub("#", now):
        return False
    for a, b in zip(NUMBER.findall(shown), NUMBER.findall(now), strict=False):
        places = max(len(n.partition(".")[2]) for n in (a, b))
        if abs(float(a) - float(b)) > 1.01 * 10.0**-places * ("." in a + b):
            return False
    return True


def differences(shown: str, now: str) -> list[str]:
    """The shown lines that did not come, or not in this order."""
    lines = [line.rstrip() for line in now.splitlines()]
    missing, begin = [], 0
    runs = parts(shown)
    for n, run_of_lines in enumerate(runs):
        size = len(run_of_lines)
        first, last = n == 0, n == len(runs) - 1
        starts = range(begin, len(lines) - size + 1)
        if first:
            starts = starts[:1]
        if last:
            starts = starts[-1:]
            if first and size != len(lines):
                starts = starts[:0]
        place = next((k for k in starts if all(map(same_line, run_of_lines, lines[k : k + size]))), None)
        if place is None:
            missing += run_of_lines
        else:
            begin = place + size
    return missing


def shown_anew(shown: str, now: str) -> str:
    """The new output, with those lines left out that the old one left out.

    Raises:
        RuntimeError: A line that was shown has nothing like it any more: choose by hand.
    """
    if LEFT_OUT not in shown:
        return now.rstrip("\n") + "\n"
    lines, out, begin = now.splitlines(), [], 0
    for line in shown.splitlines():
        if line.strip() == LEFT_OUT:
            out.append(line)
            continue
        like = difflib.get_close_matches(line, lines[begin:], n=1, cutoff=0.5)
        if not like:
            raise RuntimeError(f"nothing like this line came: {line!r}\n{now}")
        begin += lines[begin:].index(like[0]) + 1
        out.append(like[0].rstrip())
    return "\n".join(out) + "\n"


def page_anew(text: str, outputs: list[str]) -> str:
    """The page with what its steps print now."""
    outputs_left = iter(outputs)

    def step_anew(match: re.Match[str]) -> str:
        now = next(outputs_left)
        if match["output"] is None:
            return match[0]
        return f"```sh\n{match['commands']}```\n\n```text\n{shown_anew(match['output'], now)}```\n"

    return STEP.sub(step_anew, text)


def main() -> None:
    """Run the tutorials, all or the one that is named, and write their pages and pictures."""
    import tutorial_pictures

    for page in pages():
        if sys.argv[1:] and page.stem not in sys.argv[1:]:
            continue
        with tempfile.TemporaryDirectory() as folder:
            text = page.read_text()
            page.write_text(page_anew(text, run(text, Path(folder))))
            for name, picture in tutorial_pictures.pictures(page.stem, Path(folder)).items():
                (FOLDER / name).write_text(picture)
        print(page.name)


if __name__ == "__main__":
    main()
