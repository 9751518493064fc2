"""Two of ``scipy.linalg``'s functions, from the extension that holds LAPACK alone.

Importing the package around it takes longer than all that a short job computes. The numbers are the same.
"""

from functools import lru_cache
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.linalg import LinAlgError

from compgen.arrays import Array


def cholesky_banded(ab: Array, overwrite_ab: bool = False, check_finite: bool = True) -> Array:
    """Factor of a symmetric matrix from its upper bands (u + 1, N).

    Raises:
        LinAlgError: It is not positive definite.
    """
    found, info = lapack().dpbtrf(np.asarray_chkfinite(ab) if check_finite else ab, overwrite_ab=overwrite_ab)
    if info > 0:
        raise LinAlgError(f"{info}-th leading minor not positive definite")
    return np.asarray(found)


def cho_solve_banded(
    factor: tuple[Array, bool], b: Array, overwrite_b: bool = False, check_finite: bool = True
) -> Array:
    """Solution of a system whose factor is known, and whether that is a lower one; b (N,) or (N, k)."""
    bands, lower = factor
    found, _ = lapack().dpbtrs(
        bands, np.asarray_chkfinite(b) if check_finite else b, lower=lower, overwrite_b=overwrite_b
    )
    return np.asarray(found)


@lru_cache(maxsize=1)
def lapack() -> Any:
    """The extension, or the package where it is built in another way."""
    package = find_spec("scipy")
    folders = [str(Path(p) / "linalg") for p in (package and package.submodule_search_locations) or ()]
    spec = PathFinder.find_spec("_flapack", folders)
    if spec is not None and spec.loader is not None:
        try:
            module = module_from_spec(spec)
            spec.loader.exec_module(module)
        except ImportError:  # its libraries are found by the package only
            pass
        else:
            return module
    from scipy.linalg import lapack as whole

    return whole
