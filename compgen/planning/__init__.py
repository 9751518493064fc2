"""Where the tool shall be, and when."""
