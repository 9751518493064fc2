"""A program as it was written and as a controller gives it back."""
