"""A machine proposed from six days of a real lathe by `twin new --from-log`, judged on eight others, days at random.

Needs the measured data (TWIN_MEASURED_DATA) and says so where there are none. `python -m benchmarks.members 3` takes
three choices. Choices are those of a fixed seed: the same days for everyone.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from models.measured import VARIABLE
from models.recordings import lathe_days
from twin.calibrate.members.find import without_model
from twin.calibrate.propose.clean import cleaned
from twin.calibrate.propose.columns import read_log
from twin.calibrate.propose.judge import figures, predictions

CHOICES = 8
FITTED, SEALED = 6, 8  # days
SEED = 5


def main() -> None:
    paths = lathe_days()
    if not paths:
        print(f"   not run: no measured data; set {VARIABLE} to the folder that holds lathe")
        return
    given = [int(a) for a in sys.argv if a.isdigit()]
    rng = np.random.default_rng(SEED)
    rows = []
    print(f"   rms [um] of {SEALED} days, X and Z; fitted to {FITTED} others     nothing       ridge         network")
    for _ in range(given[0] if given else CHOICES):
        order = rng.permutation(len(paths))
        fitted, sealed = ([paths[i] for i in part] for part in (order[:FITTED], order[FITTED : FITTED + SEALED]))
        rows.append(figures_of(fitted, sealed))
        told(", ".join(p.stem[4:] for p in sorted(fitted)), rows[-1])
    told("mean", np.mean(rows, axis=0))


def figures_of(fitted: Sequence[Path], sealed: Sequence[Path]) -> np.ndarray:
    """(3, 2) um: nothing, ridge regression, network; X and Z."""
    runs, _ = cleaned([read_log(p)[0] for p in fitted])
    others, _ = cleaned([read_log(p)[0] for p in sealed])
    made = [f for f in figures(predictions(without_model(runs), runs, others)) if f.part == "sealed"]
    return 1e6 * np.array([[getattr(f, name) for f in made] for name in ("zero", "ridge", "network")])


def told(name: str, row: np.ndarray) -> None:
    print(f"   {name:<56}" + "   ".join(f"{x:5.2f} {z:5.2f}" for x, z in row))


if __name__ == "__main__":
    main()
