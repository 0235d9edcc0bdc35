"""Shared by all tests: thread counts, a cache of built models, and the machines everybody tests on."""

from __future__ import annotations

import os
from pathlib import Path

# Before numpy is imported anywhere: on two cores the threads of BLAS fight the test workers and each other.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

ROOT = Path(__file__).parents[1]
# Builds are keyed by their inputs and by the code that makes them: a second test run finds them here.
os.environ.setdefault("TWIN_CACHE", str(ROOT / ".cache" / "tests"))
