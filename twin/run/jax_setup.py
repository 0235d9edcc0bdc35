"""JAX for the edge: double precision, one BLAS thread, compiled functions kept between starts.

Import this before any other module of `twin.run` uses JAX. One thread: JAX's LAPACK is SciPy's OpenBLAS, whose threads
cost more than they bring on matrices of some hundred rows (factor 10 on a loaded machine).
"""

from __future__ import annotations

import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read by OpenBLAS when it is loaded

import twin.compiled
import twin.float64  # noqa: F401


def _limit_blas() -> None:
    """Where NumPy or SciPy were imported first, their OpenBLAS already has its threads."""
    if "numpy" not in sys.modules and "scipy" not in sys.modules:
        return
    try:
        from threadpoolctl import threadpool_limits
    except ImportError:  # threads stay as they are: slower, not wrong
        return
    threadpool_limits(1, user_api="blas")


_limit_blas()
