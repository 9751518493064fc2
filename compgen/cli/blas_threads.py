"""Linear algebra without threads of its own: rows are shared out by compgen, and more threads would only wait."""

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
