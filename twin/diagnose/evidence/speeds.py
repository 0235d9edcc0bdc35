"""The speeds that laws read, and the sources that warm with nothing else."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.special import xlogy

from twin.diagnose.model.study import Study

SPEEDS = ("m/s", "1/s")  # units


def relative_speed(study: Study, signals: Iterable[str]) -> list[np.ndarray]:
    """Per run (n,) the speed among the signals that a law reads, of its largest in the fitted runs; 0 where there is
    none."""
    runs, units = study.probed.runs, {s.name: s.unit for s in study.probed.base.load_model.signals}
    result = [np.zeros(run.drive.n_steps) for run in runs]
    for signal in signals:
        values = [np.abs(run.signals.get(signal, np.zeros(run.drive.n_steps))) for run in runs]
        top = max(float(values[k].max()) for k in study.fitted)
        if units.get(signal) in SPEEDS and top > 0.0:
            result = [v / top for v in values]
    return result


def rubs(study: Study, source: int) -> bool:
    """Whether the heat of a source is told by speeds alone."""
    load = study.probed.base.load_model
    units, read = {s.name: s.unit for s in load.signals}, load.sources[source].use.signals.values()
    return bool(read) and all(units.get(signal) in SPEEDS for signal in read)


def log_speed(study: Study, k: int, source: int) -> np.ndarray:
    """(n,) ln of the relative speed of a source in run k, less its mean over the fitted runs by the speed itself: its
    exponent then says little of how strong the source is in the mean. 0 at rest, where it emits nothing."""
    speed = relative_speed(study, study.probed.base.load_model.sources[source].use.signals.values())
    v = np.concatenate([speed[i] for i in study.fitted])
    mean = float(xlogy(v, v).sum()) / max(float(v.sum()), 1e-30)
    return np.where(speed[k] > 0.0, np.log(np.where(speed[k] > 0.0, speed[k], 1.0)) - mean, 0.0)
