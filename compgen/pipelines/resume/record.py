"""The manifest of pages that were written anew: the same pages by name, and what was replaced when and why."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from compgen.pipelines.resume.result import Join, PageResult
from compgen.pipelines.resume.written_job import WrittenJob
from compgen.program.manifest import with_checksum


@dataclass(frozen=True, slots=True, kw_only=True)
class Rewriting:
    """Which pages were written anew, when and why."""

    from_page: int
    date: str
    why: str
    cause: Mapping[str, Any]  # the same in plain types
    loaded: int  # the last page that the controller has, 0 where nobody says
    done: int  # the last page that has run
    start: Mapping[str, Any]  # how the robot begins, to go on from
    join: Join | None


def manifest_anew(
    written: WrittenJob,
    files: Mapping[str, bytes],
    pages: Sequence[PageResult],
    rewriting: Rewriting,
    facts: Mapping[str, Mapping[str, Any]] | None = None,
) -> bytes:
    """The manifest's text.

    Args:
        written: The pages so far.
        files: The new ones, by name.
        pages: What each of them comes to.
        rewriting: Why they were written.
        facts: What the manifest says of each beside its bytes, by the file's name.
    """
    record: dict[str, Any] = json.loads(json.dumps(dict(written.record)))
    by_name = {str(entry["name"]): entry for entry in record["pages"]}
    replaced = []
    for page in pages:
        data, entry = files[page.file], by_name[page.name]
        checksum = sha256(data).hexdigest()
        sums = {"old_sha256": entry["sha256"], "new_sha256": checksum}
        replaced.append({"name": page.name, **sums, "before": page.before.record(), "after": page.after.record()})
        entry.update(sha256=checksum, bytes=len(data), **(facts or {}).get(page.file, {}))
    known_pages = {"loaded": rewriting.loaded, "done": rewriting.done}
    entry = {
        "from_page": rewriting.from_page,
        "date": rewriting.date,
        "why": rewriting.why,
        **rewriting.cause,
        **{key: page for key, page in known_pages.items() if page},
        **rewriting.start,
        "join": None if rewriting.join is None else rewriting.join.record(),
        "pages": replaced,
    }
    record["resumed"] = [*record.get("resumed", []), entry]
    return with_checksum(record)
