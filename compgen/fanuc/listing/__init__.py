"""Anyone's program: text to records and back, without loss."""
