"""What a fit compared, channel by channel, for the picture of measured beside computed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.calibrate.channels.judge import Judgement
from twin.calibrate.channels.table import with_findings
from twin.calibrate.fit.channel_table import TCP
from twin.calibrate.fit.fit import Fit
from twin.calibrate.fit.measured import BIN, Measured
from twin.logs.run import Run
from twin.logs.trace import Trace


def traces_of(fit: Fit, runs: Sequence[Run], judgement: Judgement | None = None) -> tuple[Trace, ...]:
    """A trace per run and channel at the values of the fit. runs: as logged, nothing set aside, in its order."""
    names = [run.name for run in fit.problem.runs]
    traces: list[Trace] = []
    for run, logged, (T, w) in zip(fit.problem.runs, runs, fit.problem.outputs(fit.x), strict=True):
        traces += traces_of_run(run.measured, logged, T, w)
    return with_findings(traces, judgement, names) if judgement is not None else tuple(traces)


def traces_of_run(m: Measured, logged: Run, T: np.ndarray, w: np.ndarray) -> list[Trace]:
    """Of computed means of sensors T (b, s) [degC] and deviations w (k, 3) [m], beside the run as it was logged."""
    traces = [
        Trace(m.name, sensor, "degC", m.bin_time, means_of(logged, sensor, m.bin_time), m.temperature[:, c], T[:, c])
        for c, sensor in enumerate(m.sensors)
    ]
    return traces + [
        Trace(m.name, axis, "m", m.tcp_time, m.tcp[:, c], m.tcp[:, c], w[:, c])
        for c, axis in enumerate(TCP)
        if np.isfinite(m.tcp[:, c]).any()
    ]


def means_of(run: Run, sensor: str, bin_time: np.ndarray) -> np.ndarray:
    """Means (b,) of all readings of a column in bins about times (b,) [s], used or not; NaN where there are none."""
    if run.temperatures is None or sensor not in run.temperatures.columns or not len(bin_time):
        return np.full(len(bin_time), np.nan)
    time, values = run.temperatures.time, run.temperatures.columns[sensor]
    number = np.floor((time - bin_time[0]) / BIN + 0.5)
    own = np.isfinite(values) & (number >= 0) & (number < len(bin_time))
    at = number[own].astype(int)
    count = np.bincount(at, minlength=len(bin_time))
    total = np.bincount(at, values[own], minlength=len(bin_time))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
