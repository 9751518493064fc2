"""Robots and frames from measurements."""
