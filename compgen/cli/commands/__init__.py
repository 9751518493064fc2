"""The commands, a file each, and the files that they write."""
