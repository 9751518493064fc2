"""The manifest of a program in pages: in which order they are loaded, and what each must be.

JSON, so that whoever loads the pages, a person or a program, can check them before they run.
"""

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256
from typing import Any

from compgen.core.units import KB
from compgen.fanuc.paging.capacity import Store
from compgen.fanuc.paging.join_check import JoinError, order_of
from compgen.fanuc.paging.split import Paged

SCHEMA = 1


def manifest(paged: Paged, store: Store, head: Mapping[str, Any], more: Sequence[Mapping[str, Any]] = ()) -> bytes:
    """The manifest's text.

    Args:
        paged: The program in pages.
        store: What they were made to fit.
        head: What the program was made from, in plain types.
        more: For each page what else is known of it: when it starts, how warm the robot is.
    """
    pages = []
    for k, (page, known) in enumerate(zip(paged.pages, more or [{}] * len(paged.pages)), 1):
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
                **known,
                "relies_on_the_page_before": list(page.notes),
            }
        )
    loads = [sum(p.size.memory for p in paged.pages if p.load == n) for n in range(1, paged.loads + 1)]
    data = {
        "schema": SCHEMA,
        "name": paged.name,
        **head,
        "main": {"file": f"{paged.name}.LS", "sha256": sha256(paged.main).hexdigest(), "bytes": len(paged.main)},
        "controller": {
            "max_lines": store.max_lines,
            "max_positions": store.max_positions,
            "memory_kB": store.memory / KB,
            "name_length": store.name_length,
        },
        "drip_feed": paged.loads > 1,
        "loads": paged.loads,
        "largest_load_kB": round(max(loads) / KB, 3),
        "pages": pages,
    }
    return (json.dumps(data, indent=2, allow_nan=False) + "\n").encode()


def check_manifest(data: bytes, files: Mapping[str, bytes]) -> tuple[bytes, dict[str, bytes]]:
    """The main program and the pages, by program name, that a manifest speaks of.

    Args:
        data: The manifest.
        files: File name to content.

    Raises:
        JoinError: A file is missing or another than was written, or the main program calls in another order.
    """
    told = json.loads(data)
    for entry in [told["main"], *told["pages"]]:
        content = files.get(entry["file"])
        if content is None:
            raise JoinError(f"{entry['file']}: the manifest names it, but it is not there")
        if sha256(content).hexdigest() != entry["sha256"]:
            raise JoinError(
                f"{entry['file']}: it is not the file that the manifest names; load the one written with it"
            )
    main = files[told["main"]["file"]]
    order = tuple(page["name"] for page in sorted(told["pages"], key=lambda page: page["order"]))
    if order_of(main) != order:
        raise JoinError(f"{told['main']['file']}: it calls {', '.join(order_of(main))}; the manifest says {order}")
    return main, {page["name"]: files[page["file"]] for page in told["pages"]}
