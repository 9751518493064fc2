"""How a controller smooths its commands, from a log of what it made of a program."""
