"""The user's own path, read a second time by the side that judges, and how far the tool stays from it."""
