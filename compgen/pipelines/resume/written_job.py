"""A job in pages as it stands in a folder: what wrote it, its pages byte for byte, and what was replaced since.

Its manifest is read again as ``resume`` and ``follow`` rely on it, whoever has edited it since.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, FiniteFloat

from compgen.core.exceptions import InputError, TableError
from compgen.core.files import MOST_TABLE_BYTES, read_named, read_regular
from compgen.core.json_text import read_json
from compgen.core.toml import Table, check
from compgen.job.job import Job
from compgen.pipelines.correct.program_pages import CORRECTED, UNKNOWN
from compgen.pipelines.files.path_file import load_job
from compgen.program.pages import MANIFEST_SUFFIX, SCHEMA, is_as_written

WRITTEN = "give a folder that cgen generate, or cgen pages of a corrected program, wrote pages into"
EDITED = "it was edited since: put the file back as it was written, or write the pages anew"

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
    overrides: list[str] = Field(default_factory=list)


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
    air_K: Annotated[FiniteFloat, Field(ge=-100, le=100)] | None = None
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
    resumed: list[_ResumedJob] = Field(default_factory=list)


class _Duty(_Open):
    state: Literal["moving", "idle", "off"]
    feed_mm_s: Annotated[FiniteFloat, Field(ge=0, le=1e6)]
    duration_h: Annotated[FiniteFloat, Field(ge=0, le=1e6)]
    duty: Annotated[FiniteFloat, Field(ge=0, le=1)] = 1.0


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
    resumed: list[_ResumedProgram] = Field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenPage:
    """One page as the manifest and the file have it."""

    number: int  # from 1
    name: str
    file: str
    sha256: str  # by the manifest
    first: int  # position of the undivided program that it starts at, from 0; of one that existed, its first motion
    last: int  # at which it stops
    data: bytes

    @property
    def is_as_written(self) -> bool:
        """Whether the file is still what the manifest says."""
        return sha256(self.data).hexdigest() == self.sha256


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenJob:
    """The files of a job in pages."""

    folder: str
    manifest_file: str
    record: Mapping[str, Any]  # the manifest
    main_file: str
    main: bytes
    pages: tuple[WrittenPage, ...]

    @property
    def is_corrected(self) -> bool:
        """Whether the pages are of a program that existed and was corrected, not of a planned job."""
        return CORRECTED in self.record

    @property
    def resumed(self) -> list[dict[str, Any]]:
        """What was replaced since, in order."""
        return list(self.record.get("resumed", []))

    @property
    def loaded(self) -> int:
        """The last page that was handed to the controller, as far as earlier calls said."""
        return max((int(entry.get("loaded", 0)) for entry in self.resumed), default=0)

    @property
    def done(self) -> int:
        """The last page that has run, as far as earlier calls said."""
        return max((int(entry.get("done", 0)) for entry in self.resumed), default=0)

    def files(self) -> dict[str, bytes]:
        """Name to content of the pages and the main program."""
        return {**{page.file: page.data for page in self.pages}, self.main_file: self.main}


def read_written_job(folder: Path) -> WrittenJob:
    """The job in pages that a folder holds.

    Raises:
        InputError: There is none, or a file that its manifest names is missing or no page of this package.
    """
    manifest = _manifest_of(folder)
    record, put_back = _record_of(manifest), f"put it back: {manifest.name} names it"
    entries = sorted(record["pages"], key=lambda entry: int(entry["order"]))
    if [entry["order"] for entry in entries] != list(range(1, len(entries) + 1)):
        raise InputError(f"{manifest}: its pages are not numbered 1, 2, ...; write the job anew")
    pages = tuple(
        WrittenPage(
            number=entry["order"],
            name=entry["name"],
            file=entry["file"],
            sha256=entry["sha256"],
            first=first - 1,
            last=last - 1,
            data=read_named(folder / entry["file"], put_back),
        )
        for entry in entries
        for first, last in [_extent(record, entry)]
    )
    _check_row(manifest, pages)
    _check_replaced(manifest, record, pages)
    if not is_as_written(record):
        raise InputError(
            f"{manifest}: record_sha256: not that of the rest: what it says of heat and pages that ran is not known to "
            f"be true; {EDITED}"
        )
    main_file, main_sha = record["main"]["file"], record["main"]["sha256"]
    main = read_named(folder / main_file, put_back)
    if sha256(main).hexdigest() != main_sha:
        raise InputError(f"{folder / main_file}: it is not the main program that {manifest.name} names; write it anew")
    return WrittenJob(
        folder=str(folder), manifest_file=manifest.name, record=record, main_file=main_file, main=main, pages=pages
    )


def _manifest_of(folder: Path) -> Path:
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the one that cgen generate wrote")
    manifests = sorted(folder.glob(f"*{MANIFEST_SUFFIX}"))
    if not manifests:
        raise InputError(
            f"{folder}: it holds no pages (no file *{MANIFEST_SUFFIX}): {WRITTEN}, of programs that are more than "
            "controller.max_lines or max_positions"
        )
    if len(manifests) > 1:
        names = ", ".join(m.name for m in manifests[:3])
        raise InputError(f"{folder}: it holds the pages of several jobs ({names}); give each a folder of its own")
    return manifests[0]


def _record_of(manifest: Path) -> dict[str, Any]:
    """What a manifest says, with all that is relied on in it of the type that it is written in."""
    try:
        record = read_json(read_regular(manifest, MOST_TABLE_BYTES))
    except (OSError, ValueError) as failure:
        reason = getattr(failure, "strerror", None) or str(failure)
        raise InputError(f"{manifest}: it is not a manifest of pages: {reason}; {WRITTEN}") from None
    if not isinstance(record, dict) or not {"main", "pages"} <= {*record}:
        raise InputError(f"{manifest}: it is not a manifest of pages; {WRITTEN}")
    if record.get("schema") != SCHEMA:
        given = repr(record.get("schema"))[:20]
        raise InputError(f"{manifest}: schema {given}, and this compgen reads {SCHEMA}; generate the job anew")
    if UNKNOWN in record:
        raise InputError(f"{manifest}: its pages cannot be written anew: {record[UNKNOWN]!s:.300}")
    if not {"job", CORRECTED} & {*record}:
        raise InputError(f"{manifest}: it does not say which path file and robot file made these pages; {WRITTEN}")
    try:
        check(ProgramManifest if CORRECTED in record else JobManifest, record, str(manifest))
    except TableError as failure:
        raise InputError(f"{failure}; {EDITED}") from None
    return record


def _check_row(manifest: Path, pages: Sequence[WrittenPage]) -> None:
    """Raises InputError where pages do not follow each other; those of a planned job share the position between."""
    for page, after in zip(pages, [*pages[1:], None], strict=True):
        if page.last < page.first or (after is not None and after.first - page.last not in (0, 1)):
            raise InputError(
                f"{manifest}: pages.{page.number - 1}: it goes from {page.first + 1} to {page.last + 1}"
                + (f", and the next one begins at {after.first + 1}" if after else "")
                + f"; {EDITED}"
            )


def _check_replaced(manifest: Path, record: Mapping[str, Any], pages: Sequence[WrittenPage]) -> None:
    """Raises InputError where what was replaced since is of pages that are not there."""
    for i, entry in enumerate(record.get("resumed", [])):
        where, page = f"{manifest}: resumed.{i}", entry["from_page"]
        if page > len(pages):
            raise InputError(f"{where}.from_page: {page}, and there are {len(pages)} pages; {EDITED}")
        first = pages[page - 1].first
        if entry.get("first_waypoint", first) != first:
            raise InputError(
                f"{where}.first_waypoint: {entry['first_waypoint']}, and page {page} begins at {first}; {EDITED}"
            )


def _extent(record: Mapping[str, Any], entry: Mapping[str, Any]) -> tuple[int, int]:
    """The first and the last position of a page; of one whose program was corrected its motions."""
    first, last = entry["motions"] if CORRECTED in record else (entry["first_position"], entry["last_position"])
    return int(first), int(last)


def job_of(written: WrittenJob, path_file: str | None = None, robot: str | None = None) -> Job:
    """The job that wrote the pages, read again from its files.

    Args:
        written: Its pages.
        path_file: Where the path file is now; default where it was, from the current folder or one above the pages.
        robot: The robot file; default the one that was used.

    Raises:
        InputError: The files are not there, or are others than those that the pages were made from.
    """
    made = written.record["job"]
    names = [path_file] if path_file is not None else _places(written, str(made["path_file"]))
    robots = [robot] if robot is not None else _places(written, str(made["robot_file"]))
    if not names:
        raise InputError(
            f"{written.folder}: its path file {made['path_file']} is not there; run cgen where it can be seen, or "
            "name it with --path"
        )
    wanted = str(written.record["inputs_sha256"])
    if path_file is not None and Path(path_file).stem != Path(str(made["path_file"])).stem:
        raise InputError(
            f"{path_file}: {written.folder} has the pages of {made['path_file']}, another than this; name that"
        )
    for name in names:
        job = load_job(name, robots[0] if robots else None, [str(o) for o in made.get("overrides", [])])
        if job.inputs_hash == wanted:
            return job
    raise InputError(
        f"{names[0]}: this path file, its robot file, a file it names or compgen itself is another than what made "
        f"{written.manifest_file} (inputs {job.inputs_hash[:8]}, not {wanted[:8]}); put the old back, or generate anew"
    )


def _places(written: WrittenJob, name: str) -> list[str]:
    """Where a file may be that was named when the pages were written; the hash of the inputs says which it is."""
    folders = [Path(), *Path(written.folder).absolute().parents]
    return list(dict.fromkeys(str(folder / name) for folder in folders if (folder / name).is_file()))
