"""What a planned program makes worth saying."""
