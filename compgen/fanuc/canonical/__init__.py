"""compgen's own programs, both ways: meaning to text and text to meaning."""
