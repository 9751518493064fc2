"""Changes of an existing program: numbers, inserted points, shared positions, the remark of the mark."""
