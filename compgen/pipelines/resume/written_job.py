"""A job in pages as it stands in a folder: what wrote it, its pages byte for byte, and what was replaced since.

Its manifest is read again as ``resume`` and ``follow`` rely on it: by its checksum nobody has edited it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Any

from compgen.core.exceptions import InputError
from compgen.core.files import MOST_TABLE_BYTES, read_named, read_regular
from compgen.core.json_text import read_json
from compgen.job.job import Job
from compgen.pipelines.correct.program_pages import CORRECTED, UNKNOWN
from compgen.pipelines.files.path_file import load_job
from compgen.program.pages import MANIFEST_SUFFIX, SCHEMA, is_as_written

WRITTEN = "give a folder that cgen generate, or cgen pages of a corrected program, wrote pages into"
EDITED = "it was edited since: put the file back as it was written, or write the pages anew"


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
        for entry in record["pages"]
        for first, last in [_extent(record, entry)]
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
    """What a manifest says, as it was written."""
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
    if not is_as_written(record):
        raise InputError(
            f"{manifest}: record_sha256: not that of the rest: what it says of heat and pages that ran is not known to "
            f"be true; {EDITED}"
        )
    if UNKNOWN in record:
        raise InputError(f"{manifest}: its pages cannot be written anew: {record[UNKNOWN]!s:.300}")
    if not {"job", CORRECTED} & {*record}:
        raise InputError(f"{manifest}: it does not say which path file and robot file made these pages; {WRITTEN}")
    return record


def _extent(record: Mapping[str, Any], entry: Mapping[str, Any]) -> tuple[int, int]:
    """The first and the last position of a page; of one whose program was corrected its motions."""
    first, last = entry["motions"] if CORRECTED in record else (entry["first_position"], entry["last_position"])
    return int(first), int(last)


def job_of_pages(written: WrittenJob, path_file: str | None = None, robot: str | None = None) -> Job:
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
    robots: list[str | None] = [robot] if robot is not None else [*_places(written, str(made["robot_file"]))]
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
    for name, robot_file in product(names, robots or [None]):
        job = load_job(name, robot_file, [str(o) for o in made.get("overrides", [])])
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
