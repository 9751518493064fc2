"""The manifest of a job whose pages were written anew: the same pages by name, and what was replaced when and why."""

import json
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from compgen.pipelines.planned.delivery import page_facts
from compgen.program.manifest import with_checksum

if TYPE_CHECKING:
    from compgen.pipelines.resume.result import Resumed


def manifest_anew(resumed: "Resumed", date: str, loaded: int = 0, done: int = 0) -> bytes:
    """The manifest's text.

    Args:
        resumed: The pages that were written anew.
        date: When.
        loaded: The last page that the controller has, 0 where nobody says.
        done: The last page that has run.
    """
    written, begin = resumed.written, resumed.from_page - 1
    job = resumed.planned.job
    record: dict[str, Any] = json.loads(json.dumps(dict(written.record)))
    by_name = {str(entry["name"]): entry for entry in record["pages"]}
    replaced = []
    for page, start, result in zip(written.pages[begin:], resumed.starts, resumed.pages, strict=True):
        data = resumed.files[page.file]
        checksum = sha256(data).hexdigest()
        by_name[page.name].update(sha256=checksum, bytes=len(data), **page_facts(job, start))
        replaced.append(
            {
                "name": page.name,
                "old_sha256": page.sha256,
                "new_sha256": checksum,
                "before": result.before.record(),
                "after": result.after.record(),
            }
        )
    beginning = resumed.beginning
    entry = {
        "from_page": resumed.from_page,
        "date": date,
        "why": beginning.why,
        **beginning.cause,
        **({"loaded": loaded} if loaded else {}),
        **({"done": done} if done else {}),
        "first_waypoint": written.pages[begin].first,
        "clock_s": beginning.clock,
        "state": [float(x) for x in beginning.state],
        "rise_K": {
            n: round(float(r), 4) for n, r in zip(job.heat.names, np.asarray(resumed.planned.rise[0]), strict=True)
        },
        "join": None if resumed.join is None else resumed.join.record(),
        "pages": replaced,
    }
    record["resumed"] = [*record.get("resumed", []), entry]
    return with_checksum(record)
