"""Which step lengths a run can have: within its log, and not so many that their results fill the memory."""

from __future__ import annotations

import numpy as np

from twin.errors import TwinError

MOST_BYTES = 16e9  # of results in memory: a month of minutes of the shipped five-axis machine takes 0.4 GB
STEP_SECONDS = 0.57e-3  # of one with 125 poses (docs/performance.md)
_REMEDY = "give a step within the log, for example --dt '60 s'"


def refuse_step_length(time: np.ndarray, dt: float, numbers: int) -> None:
    """Raises TwinError for steps of dt [s] that are longer than the log, or of which there are too many.

    time (m,) s of the loads; numbers: of results that each step has.
    """
    span = float(time[-1] - time[0]) if len(time) else 0.0
    usual = float(np.median(np.diff(time))) if len(time) > 1 else np.inf  # a single row holds as long as is asked
    if dt > span + usual:
        raise TwinError(f"a step of {dt:g} s is longer than the log of {span:g} s", "--dt", _REMEDY)
    steps = span / dt
    memory = 8.0 * numbers * steps
    if memory > MOST_BYTES:
        shown = f"{steps:.3g} steps, some {memory / 1e9:,.3g} GB of results and {steps * STEP_SECONDS / 3600.0:,.3g} h"
        raise TwinError(f"a step of {dt:g} s makes {shown}", "--dt", _REMEDY)
