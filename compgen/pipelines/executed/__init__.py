"""What a controller has driven beside what was written."""
