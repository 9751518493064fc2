"""The nominal arm."""
