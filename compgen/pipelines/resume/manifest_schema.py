"""A manifest of pages as it is read again: what ``resume`` and ``follow`` rely on, whoever has edited it since."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field, FiniteFloat

from compgen.core.toml import Table

Count = Annotated[int, Field(ge=0, le=10**9)]
Number = Annotated[int, Field(ge=1, le=10**9)]  # of a page, a position or a motion
FileName = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^/\\\x00-\x1f\x7f]+$")]
Time = Annotated[FiniteFloat, Field(ge=-1e11, le=1e11)]
State = list[Annotated[FiniteFloat, Field(ge=-1e6, le=1e6)]]


class _Open(Table):
    """A table with further keys, which nothing here reads."""

    model_config = ConfigDict(extra="allow")


class _File(_Open):
    file: FileName
    sha256: str


class _Page(_File):
    order: Number
    name: str


class _JobPage(_Page):
    first_position: Number
    last_position: Number


class _ProgramPage(_Page):
    motions: Annotated[list[Number], Field(min_length=2, max_length=2)]


class _Job(_Open):
    path_file: str
    robot_file: str
    overrides: list[str] = []


class _Controller(_Open):
    max_lines: Number
    max_positions: Number
    memory_kB: Annotated[FiniteFloat, Field(gt=0, le=1e12)]
    name_length: Number


class _Join(_Open):
    gap_mm: FiniteFloat


class _Resumed(_Open):
    from_page: Number
    loaded: Count = 0
    done: Count = 0
    state_toml: str = ""
    state_time_s: Time = 0.0
    join: _Join | None = None


class _ResumedJob(_Resumed):
    first_waypoint: Count
    clock_s: Time
    state: State


class _ResumedProgram(_Resumed):
    start_state: State


class _Manifest(_Open):
    main: _File
    controller: _Controller


class JobManifest(_Manifest):
    """Of a planned job."""

    pages: Annotated[list[_JobPage], Field(min_length=1)]
    job: _Job
    inputs_sha256: str
    resumed: list[_ResumedJob] = []


class _Duty(_Open):
    state: Literal["moving", "idle", "off"]
    feed_mm_s: Annotated[FiniteFloat, Field(ge=0, le=1e6)]
    duration_h: Annotated[FiniteFloat, Field(ge=0, le=1e6)]


class _Provenance(_Open):
    before: list[_Duty]
    overrides: list[str]
    planned_sha256: str
    corrected_sha256: str
    planned_zlib_b85: str


class ProgramManifest(_Manifest):
    """Of a program that existed and was corrected."""

    pages: Annotated[list[_ProgramPage], Field(min_length=1)]
    corrected_from: _Provenance
    resumed: list[_ResumedProgram] = []
