"""The story of a planned program: predict it, correct it, write it, prove it."""
