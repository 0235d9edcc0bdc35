"""Run benchmarks by name, all of them by default; every figure is printed with what it is compared with."""

from __future__ import annotations

import argparse
import importlib
import os
import resource
import time

# as the command line does; both are read when numpy is imported
for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

NAMES = (
    "machines", "certificate", "case", "plate", "poses", "moved", "turned", "step", "laws", "replay", "load_pipeline",
    "growth", "hexapod_blocks", "pymor", "steel_profile", "steel_profile_fit", "matrices", "correction", "exports",
    "c_runtime", "fmu", "calibration", "update",
    "spindle_drift", "spindle_diagnosis", "log_faults", "lathe_channels",
    "members", "diagnosis", "recovery", "hidden_certify",
    "window", "live", "serve",
)  # fmt: skip
# by name alone: a day, hours, or a package index
ASKED = ("sensitivity", "lathe_diagnosis", "lathe_damaged", "lathe_calibration", "install")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", default=NAMES, help=f"of {', '.join((*NAMES, *ASKED))}")
    for name in parser.parse_args().names:
        module = importlib.import_module(f"benchmarks.{name}")
        print(f"\n== {name}: {module.__doc__.strip().splitlines()[0]}", flush=True)
        began = time.perf_counter()
        module.main()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        print(
            f"   ({time.perf_counter() - began:.0f} s, peak memory of this process so far {peak:.2f} GiB)", flush=True
        )


if __name__ == "__main__":
    main()
