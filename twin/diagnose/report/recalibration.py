"""What calibration had to change before the description fitted, and whether what is left is noise: said with a verdict
of nothing, because a tolerance swallows what lies within it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

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
    said = list[tuple[str, list[Pull]]]()
    for moved, least, factor, unit, of in (
        (of_sensors, KELVIN, 1.0, "K", _temperature), (of_tcp, METRES, 1e6, "um", _displacement)
    ):  # fmt: skip
        size, channel, run = max(moved, key=lambda m: m[0])
        if size > least:
            said.append((f"{channel} by {number(factor * size)} {unit} (rms) in {run}", _large(d.pulls, of, least)))
    if not said:
        return ""
    alike = all(most == said[0][1] for _, most in said)
    told = [(" and ".join(words for words, _ in said), said[0][1])] if alike else said
    clauses = [
        words + (f", most of it by {' and by '.join(map(_value, most))}" if most else "") for words, most in told
    ]
    return f"the description as delivered is not right: calibration moved {'; and '.join(clauses)}"


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
    most = (
        f", the most {name}, {size} (rms): twin calibrate takes all laws as described, and may leave less; what it "
        "moves far from its prior is worth a look then"
    ) if weight >= 1.0 else ""  # fmt: skip
    return (
        f"what is left is no noise (correlated by {np.nanmedian(after):.2f} from bin to bin), but no more than "
        f"simulated machines without an effect leave{most}"
    )


def large(pulls: Sequence[Pull]) -> list[Pull]:
    """Those that a headline names: what moves temperatures or the TCP far."""
    named = [*_large(pulls, _temperature, KELVIN), *_large(pulls, _displacement, METRES)]
    return [p for p in dict.fromkeys(named) if _temperature(p) >= KELVIN or _displacement(p) >= METRES]


def _large(pulls: Sequence[Pull], of: Callable[[Pull], float], least: float) -> list[Pull]:
    """Those that move a channel by so much (rms), LARGE at most, the largest first; the largest where none does."""
    ordered = sorted((p for p in pulls if of(p) > 0.0), key=of, reverse=True)
    return [p for p in ordered if of(p) >= least][:LARGE] or ordered[:1]


def _temperature(pull: Pull) -> float:
    return pull.temperature_change


def _displacement(pull: Pull) -> float:
    return pull.displacement_change


def _value(pull: Pull) -> str:
    """As "sources.motor.gain, 1.35 (95 % interval 1.09 to 1.67) instead of 1"."""
    shift = 1.96 * abs(pull.value - pull.nominal) / max(abs(pull.pull), 1e-9) * pull.sigma
    size = size_words(pull.value, (pull.value - shift, pull.value + shift), pull.unit)
    return f"{pull.path}, {size} instead of {quantity(pull.nominal, pull.unit)}"
