"""Options, their words and their completion."""
