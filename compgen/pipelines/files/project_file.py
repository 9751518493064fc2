"""``cgen.toml``, the file of a project: what its path files take where they say nothing; no bound becomes looser."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from math import isfinite
from pathlib import Path
from typing import Any, Literal

from compgen.core.exceptions import InputError, TableError
from compgen.core.files import PROJECT
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.toml import Table, TomlText, check, line_of_key, read_toml_text
from compgen.job.tables import LargestTable

ONE_ABOVE = 1  # folders above the first that belong to it where there is no repository


class ProjectTable(Table):
    """Defaults of a project."""

    robot: str = ""
    """Of path files that name none: a robot's name, or a robot file as it lies from this file."""
    assets: Literal["inline", "shared"] | None = None
    """Where plotly.js lies, in the place of --assets."""
    bounds: LargestTable = LargestTable()
    """Of path files without them; where both have one the tighter holds."""


@dataclass(frozen=True, slots=True)
class Project:
    """A project's file."""

    source: Path
    table: ProjectTable
    text: TomlText
    notes: tuple[Finding, ...] = ()  # what it gave, and what of it is not used
    gives_robot: bool = False  # the path file and the call name none

    def record(self, path_file: Path) -> dict[str, dict[str, str]]:
        """The file as an input of a path file's job: its place from there, and its hash."""
        place = os.path.relpath(self.source.resolve(), path_file.resolve().parent)
        return {"project": {"file": Path(place).as_posix(), "sha256": sha256(self.text.content).hexdigest()}}

    def filling(self, tables: dict[str, Any], typed: Sequence[str]) -> "Project":
        """Put defaults into a path file's tables; the project, with what is said of them.

        Args:
            tables: Of the path file, filled in place.
            typed: Keys that are set in the call, ``robot`` for its option: they hold whatever the files say.
        """
        used, looser = [], []
        if self.table.robot and "robot" not in tables:
            is_file = self.table.robot.endswith(".toml")
            tables["robot"] = str(self.source.parent / self.table.robot) if is_file else self.table.robot
            used = [] if "robot" in typed else [f"robot = {self.table.robot}"]
        gives_robot = bool(used)
        limits = self.table.bounds.model_dump(exclude_none=True)
        own = tables.setdefault("bounds", {}) if limits else {}
        for key, limit in limits.items() if isinstance(own, dict) else ():
            bound = own.get(key, limit)
            if f"bounds.{key}" in typed or not isinstance(bound, int | float) or not isfinite(bound):
                continue  # the call's holds, or what is no number is refused
            if bound < limit:
                looser.append(f"bounds.{key} = {limit:g} is looser than the path file's own {bound:g}, which holds")
            else:
                used.append(f"bounds.{key} = {limit:g}" + (f" (path file: {bound:g})" if bound > limit else ""))
                own[key] = limit
        notes = [Finding(Level.NOTE, Code.PROJECT_FILE, f"{self.source} gives {', '.join(used)}")] if used else []
        notes += [Finding(Level.WARNING, Code.PROJECT_FILE, f"{self.source}: {one}") for one in looser]
        return replace(self, notes=tuple(notes), gives_robot=gives_robot)


def find_project(*starts: Path) -> Project | None:
    """The project file that is nearest: in a folder or above it, up to the repository's root; None where there is none.

    Args:
        starts: Folders, one after the other until there is one.

    Raises:
        InputError: It cannot be read, or a key of it is wrong: names file and line.
    """
    for start in starts:
        folders = [start.resolve(), *start.resolve().parents]
        top = next((n for n, folder in enumerate(folders) if os.path.exists(folder / ".git")), ONE_ABOVE)
        for folder in folders[: top + 1]:
            if os.path.isfile(folder / PROJECT):
                return _read(Path(os.path.relpath(folder / PROJECT)))
    return None


def _read(source: Path) -> Project:
    text = read_toml_text(source, "paths")
    try:
        return Project(source, check(ProjectTable, text.tables, str(source)), text)
    except TableError as failure:
        reason = str(failure).removeprefix(f"{source}: ")
        line = line_of_key(text.content.decode("utf-8-sig"), reason.partition(":")[0])
        raise InputError(f"{source}: line {line}: {reason}") from None
