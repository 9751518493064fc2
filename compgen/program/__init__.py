"""What any program is, whoever wrote it: where it drives to, on which ways, when, and what the arm does along them."""
