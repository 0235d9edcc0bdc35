"""What calibration had to change before the description fitted, and whether what is left is noise: said with a verdict
of nothing, because a tolerance swallows what lies within it.
"""

from __future__ import annotations

import numpy as np

from twin.diagnose.result.diagnosis import Diagnosis, Pull
from twin.diagnose.result.numbers import number, quantity, size_words

KELVIN, METRES = 0.5, 3e-6  # rms of a channel, from which a change is told: what users asked for
WHITE = 0.2  # correlation from bin to bin: two standard deviations of that of 100 bins (8 h) of white noise


def moved_words(d: Diagnosis) -> str:
    """How far calibration moved the channels that it moved most, and by which parameter; empty below KELVIN, METRES."""
    T, w = 0.0, 0.0
    sensor, axis, run_T, run_w = "", "", "", ""
    for s in d.series:
        if s.sealed:
            continue
        of_sensors, of_tcp = (
            np.sqrt(np.nanmean(np.square(np.where(np.isfinite(v), v, 0.0)), axis=0)) if len(v) else np.zeros(v.shape[1])
            for v in (s.recalibrated - s.delivered, s.tcp_recalibrated - s.tcp_delivered)
        )
        if of_sensors.max(initial=0.0) > T:
            T, sensor, run_T = float(of_sensors.max()), s.sensors[int(of_sensors.argmax())], s.run
        if of_tcp.max(initial=0.0) > w:
            w, axis, run_w = float(of_tcp.max()), f"d{'xyz'[int(of_tcp.argmax())]}", s.run
    said = []
    if T > KELVIN:
        said.append(f"sensors.{sensor} by {number(T)} K in {run_T}")
    if w > METRES:
        said.append(f"{axis} by {number(1e6 * w)} um in {run_w}")
    if not said:
        return ""
    most = max(d.pulls, key=_weight, default=None)
    by = f", most of it by {_value(most)}" if most is not None and _weight(most) > 0.0 else ""
    return f"first of all, the description as delivered is not right: calibration moved {' and '.join(said)} (rms){by}"


def left_words(d: Diagnosis) -> str:
    """What is left, where it is no white noise; empty where it is."""
    after = np.array([w[2] for w in d.whiteness], dtype=float)
    if not np.isfinite(after).any() or np.nanmedian(after) < WHITE:
        return ""
    return (
        f"what is left is no noise (correlated by {np.nanmedian(after):.2f} from bin to bin), but no more than "
        "simulated machines without an effect leave"
    )


def _weight(pull: Pull) -> float:
    return max(pull.temperature_change / KELVIN, pull.displacement_change / METRES)


def _value(pull: Pull) -> str:
    """As "sources.motor.gain, 1.35 (95 % interval 1.09 to 1.67) instead of 1"."""
    shift = 1.96 * abs(pull.value - pull.nominal) / max(abs(pull.pull), 1e-9) * pull.sigma
    size = size_words(pull.value, (pull.value - shift, pull.value + shift), pull.unit)
    return f"{pull.path}, {size} instead of {quantity(pull.nominal, pull.unit)}"
