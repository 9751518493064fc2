"""A cell and what it is to do, in SI, and what follows from these before anything is flown."""
