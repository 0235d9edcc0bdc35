"""Functions that JAX has compiled are kept between starts, in a folder of ours in the user's cache ($TWIN_CACHE).

Import this before JAX compiles anything: a law takes a quarter of a second each time otherwise.
"""

from __future__ import annotations

import os
from pathlib import Path

import jax


def _cache_folder() -> Path | None:
    """A folder that can be written, else None. TWIN_CACHE overrides, "" switches off."""
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


_keep_compiled(_cache_folder())
