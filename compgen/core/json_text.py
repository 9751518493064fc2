"""The one way a record becomes text."""

import json


def json_text(record: object) -> bytes:
    """A record in plain types as indented JSON, the same bytes for the same record; raises ValueError for NaN."""
    return (json.dumps(record, indent=2, allow_nan=False) + "\n").encode()
