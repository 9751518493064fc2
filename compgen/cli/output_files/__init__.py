"""Folders of output: whose they are, and how files get there at once."""
