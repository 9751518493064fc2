"""The command line: the only place that prints, writes files, catches exceptions and sets exit codes."""
