"""Before numpy is loaded: linear algebra without threads of its own, and nothing of numpy's from the environment.

Rows are shared out by compgen, and more threads would only wait.
"""

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    if not os.environ.get(_name, "").isdigit():
        os.environ[_name] = "1"
os.environ.pop("SOURCE_DATE_EPOCH", None)  # numpy dates with it what we never make, and ends where it is no number
