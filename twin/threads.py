"""One thread for each BLAS: to be asked for before NumPy is imported, which reads it once."""

from __future__ import annotations

import os


def one_thread_each() -> None:
    """Ask OpenBLAS and MKL for one thread, unless the user has chosen another number.

    JAX calls SciPy's OpenBLAS; with its threads small factorisations take 9 to 22 ms instead of 0.1, and on two cores a
    whole build takes twice as long. MKL likewise: builds work on several things at once, each in one thread, so that
    equal input gives equal bits.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("MKL_NUM_THREADS", "1")
