"""What calibration had to change before the description fitted, and whether what is left is noise: said with a verdict
of nothing, because a tolerance swallows what lies within it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.diagnose.model.study import COMPONENTS
from twin.diagnose.result.diagnosis import Diagnosis, Pull
from twin.diagnose.result.numbers import number, quantity, rms, size_words

KELVIN, METRES = 0.5, 3e-6  # rms of a channel, from which a change is told: what users asked for
LARGE = 3  # parameters at most that a headline names
WHITE = 0.2  # correlation from bin to bin: two standard deviations of that of 100 bins (8 h) of white noise


def moved_words(d: Diagnosis) -> str:
    """How far calibration moved the channels that it moved most, and by which parameters; empty below these sizes."""
    of_sensors, of_tcp = [(0.0, "", "")], [(0.0, "", "")]
    for s in (s for s in d.series if not s.sealed):
        changes = s.recalibrated - s.delivered, s.tcp_recalibrated - s.tcp_delivered
        T, w = (np.nan_to_num(rms(change)).tolist() for change in changes)
        of_sensors += [(v, f"sensors.{name}", s.run) for v, name in zip(T, s.sensors, strict=True)]
        of_tcp += [(v, name, s.run) for v, name in zip(w, COMPONENTS, strict=True)]
    said = []
    for moved, least, factor, unit in ((of_sensors, KELVIN, 1.0, "K"), (of_tcp, METRES, 1e6, "um")):
        size, channel, run = max(moved, key=lambda m: m[0])
        if size > least:
            said.append(f"{channel} by {number(factor * size)} {unit} in {run}")
    if not said:
        return ""
    most = large(d.pulls) or [p for p in sorted(d.pulls, key=_weight)[-1:] if _weight(p) > 0.0]
    by = f", most of it by {' and by '.join(map(_value, most))}" if most else ""
    return f"first of all, the description as delivered is not right: calibration moved {' and '.join(said)} (rms){by}"


def left_words(d: Diagnosis) -> str:
    """What is left, and where most, if it is no white noise; empty where it is."""
    after = np.array([w[2] for w in d.whiteness], dtype=float)
    if not np.isfinite(after).any() or np.nanmedian(after) < WHITE:
        return ""
    left = [(0.0, "", "")]
    for s in (s for s in d.series if not s.sealed):
        for names, values, of, unit in (
            (s.sensors, s.extended, KELVIN, "K"),
            (COMPONENTS, s.tcp_extended, METRES, "m"),
        ):
            sizes = np.nan_to_num(rms(values)).tolist() if np.size(values) else ()
            left += [(v / of, quantity(v, unit), name) for v, name in zip(sizes, names, strict=False)]
    weight, size, name = max(left)
    most = f", the most {name}, {size} (rms)" if weight >= 1.0 else ""
    return (
        f"what is left is no noise (correlated by {np.nanmedian(after):.2f} from bin to bin), but no more than "
        f"simulated machines without an effect leave{most}"
    )


def large(pulls: Sequence[Pull]) -> list[Pull]:
    """Those that move a channel by KELVIN or METRES (rms), LARGE at most, the largest first."""
    return sorted((p for p in pulls if _weight(p) >= 1.0), key=_weight, reverse=True)[:LARGE]


def _weight(pull: Pull) -> float:
    return max(pull.temperature_change / KELVIN, pull.displacement_change / METRES)


def _value(pull: Pull) -> str:
    """As "sources.motor.gain, 1.35 (95 % interval 1.09 to 1.67) instead of 1"."""
    shift = 1.96 * abs(pull.value - pull.nominal) / max(abs(pull.pull), 1e-9) * pull.sigma
    size = size_words(pull.value, (pull.value - shift, pull.value + shift), pull.unit)
    return f"{pull.path}, {size} instead of {quantity(pull.nominal, pull.unit)}"
