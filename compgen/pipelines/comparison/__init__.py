"""Two outputs of compgen of one kind: what went in, what came out, and how far the commanded positions moved."""
