"""What an earlier run of a program in pages has left."""

import json
from hashlib import sha256
from pathlib import Path


def written_before(manifest: Path) -> set[str]:
    """Files that an earlier run's manifest names and that are still what it wrote; the manifest with them."""
    try:
        told = json.loads(manifest.read_bytes())
        entries = {str(e["file"]): str(e["sha256"]) for e in [told["main"], *told["pages"]]}
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    mine = {manifest.name}
    for name, checksum in entries.items():
        place = manifest.with_name(Path(name).name)
        try:
            if not place.is_symlink() and sha256(place.read_bytes()).hexdigest() == checksum:
                mine.add(place.name)
        except OSError:
            continue
    return mine
