"""JAX for the edge: double precision, one BLAS thread, compiled functions kept between starts.

Import this before any other module of `twin.run` uses JAX. One thread: JAX's LAPACK is SciPy's OpenBLAS, whose threads
cost more than they bring on matrices of some hundred rows (factor 10 on a loaded machine).
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read by OpenBLAS when it is loaded

import jax

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


def _cache_folder() -> Path | None:
    """A folder of ours in the user's cache that can be written, else None. TWIN_CACHE overrides, "" switches off."""
    chosen = os.environ.get("TWIN_CACHE")
    if chosen == "":
        return None
    base = Path(chosen) if chosen else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "twin"
    folder = base / f"jax-{jax.__version__}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None


def _keep_compiled(folder: Path | None) -> None:
    """JAX writes entries atomically and goes on without the cache where writing fails."""
    if folder is None:
        return
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", 0)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_raise_persistent_cache_errors", False)


_limit_blas()
_keep_compiled(_cache_folder())
