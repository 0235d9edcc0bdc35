"""Other explanations of the same data, as reports take them, and what would tell two of them apart."""

from __future__ import annotations

import math

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.faults.table import fault_of, what
from twin.diagnose.result.diagnosis import Rival
from twin.diagnose.result.spot import Of, Spot
from twin.diagnose.search.policy import POLICY, SearchPolicy


def rival_of(h: Hypothesis, cosine: float, remedy: str = "", policy: SearchPolicy = POLICY) -> Rival:
    """A hypothesis in a row of a table. Its interval is that of an amplitude that enters linearly, of which the
    statistic is (amplitude / sigma)^2; an exact factor has none."""
    value, place, fault = h.amplitude[0], h.name, fault_of(h)
    if fault.corrects:
        place, factor = fault.factor(place)
        return Rival(h.family, place, h.when.name, factor, h.batch.unit, h.statistic, cosine, remedy)
    half = policy.sure * abs(value) / math.sqrt(h.statistic) if h.statistic > 0.0 and not h.batch.fixed else math.nan
    told = fault.curve.told
    ci95 = (told(value - half), told(value + half))
    size = math.nan if fault.exchanges else told(value)
    return Rival(h.family, place, h.when.name, size, h.batch.unit, h.statistic, cosine, remedy, ci95)


def rival_beside(chosen: Hypothesis, other: Hypothesis, cosine: float, policy: SearchPolicy) -> Rival:
    apart = min(chosen.statistic, other.statistic) * (1.0 - cosine**2) > policy.apart
    return rival_of(other, cosine, "" if apart and not as_good(other, chosen, policy) else remedy(chosen, other))


def as_good(other: Hypothesis, lead: Hypothesis, policy: SearchPolicy) -> bool:
    """Whether another hypothesis explains what the leading one does, but for chance and the error of its response: the
    data have decided nothing then, however unlike each other they are."""
    price = policy.amplitude * (other.batch.q - lead.batch.q)
    return other.statistic - price > lead.statistic - max(policy.close, policy.misfit * lead.statistic)


def remedy(a: Hypothesis, b: Hypothesis) -> str:
    """What would tell two causes apart that these data do not."""
    wrong = next((h for h in (a, b) if fault_of(h).corrects), None)
    if wrong is not None:
        return reading_beside(wrong)
    if moved := next((h for h in (a, b) if fault_of(h).moves), None):
        return f"a look at where {Spot.read(moved.name).name} is mounted"
    if any(Spot.read(h.name).between for h in (a, b)):
        return "a run of loads and rests, an hour each: through a joint heat goes on while one of its sides is warm"
    # of a part's number and its material's, which no temperature separates
    if a.name != b.name and {Spot.read(h.name).of for h in (a, b)} <= {Of.MATERIAL, Of.PART}:
        return f"a measurement of {a.name}, or of {b.name}, by itself"
    if a.name != b.name and a.when.name == b.when.name:
        return in_the_air(a) or in_the_air(b) or sensor_between(a.name, b.name)
    if a.name == b.name and fault_of(a).read and fault_of(b).read:
        return f"a longer run, measured twice as often: {a.when.name} and {b.when.name} differ there"
    signals = [h.when.signal for h in (a, b) if h.when.signal]
    if a.name == b.name and a.when.signal and a.when.signal == b.when.signal:
        return f"a run with {a.when.signal} held for 2 h each at a third, two thirds and all of its range"
    if signals:
        return f"a run in which {' and '.join(dict.fromkeys(signals))} work alone, and one in which they rest"
    if a.name == b.name:
        both = f"{what(a.family)} and {what(b.family)}"
        return f"a run in which the air is 5 K colder, and one that cools from standstill: {both} differ there"
    return f"temperature sensors at {a.name} and at {b.name}"


def sensor_between(a: str, b: str) -> str:
    return f"a temperature sensor between {a} and {b}, nearer to one of them"


def in_the_air(h: Hypothesis) -> str:
    """What tells another temperature of a film's medium from anything else; "" for other causes."""
    return f"a temperature sensor in the air at {h.name}" if Spot.read(h.name).air and h.batch.unit == "K" else ""


def reading_beside(h: Hypothesis) -> str:
    """What tells whether a signal is declared rightly."""
    signal, _ = fault_of(h).factor(h.name)
    return f"one reading of {signal} beside an instrument, or what the drive's manual says it logs"
