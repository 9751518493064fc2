"""What a controller did with a program: a log of positions from the run, judged against the program's text."""
