"""The manifest of a program in pages: the order in which they are loaded, and the checksum of each.

JSON, so that whoever loads the pages, a person or a program, can check them before they run. What ``resume`` takes from
it (which pages have run, how warm the robot was) no other file says again: its last key is the checksum of the rest.
"""

from collections.abc import Mapping, Sequence
from hashlib import sha256
from typing import Any

from compgen.core.json_text import json_text
from compgen.core.units import KB
from compgen.program.pages import Capacity, PagedProgram

SCHEMA = 1
MANIFEST_SUFFIX = ".pages.json"  # behind the program's name
CHECKSUM = "record_sha256"  # of a manifest without this key


def manifest_json(
    paged: PagedProgram, capacity: Capacity, head: Mapping[str, Any], page_facts: Sequence[Mapping[str, Any]] = ()
) -> bytes:
    """The manifest's text.

    Args:
        paged: The program in pages.
        capacity: What they were made to fit.
        head: What the program was made from, in plain types.
        page_facts: For each page what else is known of it: when it starts, how warm the robot is.
    """
    pages = []
    for k, (page, facts) in enumerate(zip(paged.pages, page_facts or [{}] * len(paged.pages), strict=True), 1):
        pages.append(
            {
                "order": k,
                "load": page.load,
                "name": page.name,
                "file": f"{page.name}.LS",
                "sha256": sha256(page.data).hexdigest(),
                "bytes": len(page.data),
                "lines": page.size.lines,
                "positions": page.size.positions,
                "memory_kB": round(page.size.memory / KB, 3),
                "motions": [page.motions[0] + 1, page.motions[1]],
                **facts,
                "relies_on_the_page_before": list(page.notes),
            }
        )
    memory = [sum(p.size.memory for p in paged.pages if p.load == n) for n in range(1, paged.load_count + 1)]
    data = {
        "schema": SCHEMA,
        "name": paged.name,
        **head,
        "main": {"file": f"{paged.name}.LS", "sha256": sha256(paged.main).hexdigest(), "bytes": len(paged.main)},
        "controller": {
            "max_lines": capacity.max_lines,
            "max_positions": capacity.max_positions,
            "memory_kB": capacity.memory / KB,
            "name_length": capacity.name_length,
        },
        "drip_feed": paged.load_count > 1,
        "loads": paged.load_count,
        "largest_load_kB": round(max(memory) / KB, 3),
        "pages": pages,
    }
    return with_checksum(data)


def with_checksum(record: Mapping[str, Any]) -> bytes:
    """The text of a manifest, with the checksum of everything in it."""
    rest = {key: value for key, value in record.items() if key != CHECKSUM}
    return json_text({**rest, CHECKSUM: sha256(json_text(rest)).hexdigest()})


def is_as_written(record: Mapping[str, Any]) -> bool:
    """Whether a manifest still says what it said when it was written, or is older than this; its layout is free."""
    try:
        return CHECKSUM not in record or json_text(record) == with_checksum(record)
    except ValueError:  # NaN, which none has
        return False
