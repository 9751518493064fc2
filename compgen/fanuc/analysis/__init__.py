"""What a program means: frames, modal state, order, what may be corrected."""
