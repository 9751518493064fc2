"""Error sources from measurements."""
