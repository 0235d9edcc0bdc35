"""What calibration had to change before the description fitted, and whether what is left is noise: said with a verdict
of nothing, because a tolerance swallows what lies within it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.diagnose.model.study import COMPONENTS
from twin.diagnose.result.diagnosis import Diagnosis, Pull
from twin.diagnose.result.numbers import quantity, rms, size_words

KELVIN, METRES = 0.5, 3e-6  # rms of a channel, from which a change is told: what users asked for
LARGE = 3  # parameters at most that a headline names
SURE = 1.96  # standard deviations, of a 95 % interval
WHITE = 0.2  # correlation from bin to bin: two standard deviations of that of 100 bins (8 h) of white noise


def moved_words(d: Diagnosis) -> str:
    """How far calibration moved the channels that it moved most, and by which parameters; empty below these sizes."""
    of_sensors, of_tcp = [(0.0, "", "")], [(0.0, "", "")]
    for s in (s for s in d.series if not s.sealed):
        changes = s.recalibrated - s.delivered, s.tcp_recalibrated - s.tcp_delivered
        T, w = (np.nan_to_num(rms(change)).tolist() for change in changes)
        of_sensors += [(v, name, s.run) for v, name in zip(T, s.sensors, strict=True)]
        of_tcp += [(v, name, s.run) for v, name in zip(w, COMPONENTS, strict=True)]
    said = list[tuple[str, list[Pull]]]()
    for moved, least, unit, where in ((of_sensors, KELVIN, "K", "sensors."), (of_tcp, METRES, "m", "")):
        size, channel, run = max(moved, key=lambda m: m[0])
        if size > least:
            words = f"{where}{channel} by {quantity(size, unit)} (rms) in {run}"
            said.append((words, _large(d.pulls, channel, least)))
    if not said:
        return ""
    alike = all(most == said[0][1] for _, most in said)
    told = [(" and ".join(words for words, _ in said), said[0][1])] if alike else said
    clauses = [
        words + (f", most of it by {' and by '.join(map(_value, most))}" if most else "") for words, most in told
    ]
    sure = any(abs(p.pull) > SURE * p.sigma for _, most in said for p in most)
    head = "the description as delivered is wrong:" if sure else "within the tolerances of the description"
    return f"{head} calibration moved {'; and '.join(clauses)}"


def left_words(d: Diagnosis) -> str:
    """The residual, and where it is largest, if it is not white; empty where it is."""
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
    most = (
        f", the largest at {name}, {size} (rms): twin calibrate takes all laws as described and may leave less; then "
        "check what it moves far from its prior"
    ) if weight >= 1.0 else ""  # fmt: skip
    return (
        f"residuals are not white (lag-1 correlation {np.nanmedian(after):.2f}), but no larger than "
        f"those of simulated fault-free machines{most}"
    )


def large(pulls: Sequence[Pull]) -> list[Pull]:
    """Those that a headline may name: what moves a temperature or the TCP far."""
    channels = dict.fromkeys(name for p in pulls for name in p.changes)
    named = {
        p.path: p for name in channels for p in _large(pulls, name, _least(name)) if p.changes[name] >= _least(name)
    }
    return list(named.values())


def _least(channel: str) -> float:
    return METRES if channel in COMPONENTS else KELVIN


def _large(pulls: Sequence[Pull], channel: str, least: float) -> list[Pull]:
    """Those that move a channel by so much (rms), LARGE at most, the largest first; the largest where none does."""
    ordered = sorted((p for p in pulls if p.changes.get(channel, 0.0) > 0.0), key=lambda p: -p.changes[channel])
    return [p for p in ordered if p.changes[channel] >= least][:LARGE] or ordered[:1]


def _value(pull: Pull) -> str:
    """As "sources.motor.gain, 1.35 (95 % interval 1.09 to 1.67) instead of 1"."""
    shift = SURE * abs(pull.value - pull.nominal) / max(abs(pull.pull), 1e-9) * pull.sigma
    size = size_words(pull.value, (pull.value - shift, pull.value + shift), pull.unit)
    return f"{pull.path}, {size} instead of {quantity(pull.nominal, pull.unit)}"
