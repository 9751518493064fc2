"""What to command instead, so that the error cancels within the limits."""
