"""The proof: what the real arm and controller would do with the written text."""
