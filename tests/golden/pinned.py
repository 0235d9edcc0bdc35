"""The surroundings in which golden values are made and compared: the same digits on every x86-64 that has AVX2.

Libraries choose their kernels by what the processor offers, and kernels of another width add up in another order. So
every library is told the same instruction set, before it is imported: hence a process of its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PINNED = {
    "OPENBLAS_CORETYPE": "Haswell",  # of NumPy and of SciPy, whose LAPACK is that of JAX
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",  # NumPy's own loops: exp and pow differ in AVX512
    "XLA_FLAGS": "--xla_cpu_max_isa=AVX2 --xla_cpu_multi_thread_eigen=false",
    "MKL_CBWR": "COMPATIBLE",  # the one branch of MKL that is the same on processors of other makers
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
}


def computed(module: str, cache: Path) -> Any:
    """What `python -m module FILE` writes into a JSON file, in a process with its instruction set pinned.

    cache: its TWIN_CACHE.
    """
    cache.mkdir(parents=True, exist_ok=True)
    path = cache / f"{module}.json"
    path.unlink(missing_ok=True)
    environment = os.environ | PINNED | {"TWIN_CACHE": str(cache), "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-m", module, str(path)], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, f"{module} has failed:\n{done.stdout[-2000:]}{done.stderr[-8000:]}"
    return json.loads(path.read_text(encoding="utf-8"))
