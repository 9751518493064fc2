"""What any program is, whoever wrote it: where it drives to, when, and what the arm does."""
