"""The words of a diagnosis: causes, places and chances, a sentence per verdict, and the lines that its sections begin
with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from twin.diagnose.faults.channels_check import REFUTED
from twin.diagnose.faults.table import family_of, what
from twin.diagnose.report.recalibration import SURE, left_words, moved_words
from twin.diagnose.result.diagnosis import Cause, Diagnosis, Limit, Pull, Rival
from twin.diagnose.result.numbers import interval_and_unit, number, quantity, rms, size_words
from twin.diagnose.result.place import Support
from twin.diagnose.result.spot import Spot

LEAST_SHARE = 0.05  # of the evidence: a channel with less is not told
LINKED = 0.5  # correlation of a signal that heat goes with: a quarter of its variance
MEASURED = (("K", "temperature"), ("m", "TCP direction"))  # units of channels, and what these are
_SEEN = {  # before anything is fitted, by the history of a sensor at fault
    "stuck": "Its reading was constant for {hours} h",
    "leap": "Its reading leapt by {size} K at {at} h, faster than heat can",
    "noise": "Its reading is noise of {size} K from {at} h on",
    "rail": "Its reading rests at {size} °C from {at} h on",
}
# What follows from a verdict, for who acts on it
_FOLLOWS = {
    "named": "The extended model includes it; its gain is shown below.",
    "ambiguous": "The data allow more than one edit of the description; what to measure next is stated below.",
    "unknown": "Its location is known, its law is not; see its time history below.",
    "out_of_tolerance": "The model structure is adequate; declared values are wrong, or they absorb a fault.",
    "sensor": "The model of the machine is unchanged.",
    "signal": "The model of the machine is unchanged.",
    "too_poor": "No cause is named: with such a model many would fit. Extend it first (see the first note).",
    "nothing": "The model of the machine is unchanged. Faults below the following detection limits may be present.",
}


def place_words(place: str) -> str:
    """As "film bed" for "films.bed"; surfaces and the rest stay as they are."""
    return Spot.read(place).words


def history_words(history: str) -> str:
    """A power of a signal as such; other histories hold names of runs."""
    if history in ("", "always"):
        return ""
    return history if " " in history else history.replace("^2", "²").replace("^3", "³")


def times(family: str, unit: str) -> str:
    """What a size without a unit is a multiple of."""
    entry = family_of(family)
    return entry.times if entry and unit in ("", "1") else ""


def sized(family: str, value: float, unit: str) -> str:
    """An SI value in its customary unit, or what it is a multiple of."""
    return f"{quantity(value, unit)} {times(family, unit)}".rstrip()


def setting_words(cause: Cause) -> str:
    """What a size holds for: the surface that heat really enters, the medium, the part that a scale follows."""
    settings, said = cause.settings, []
    if surface := settings.get("surface"):
        said.append(f"which enters at {surface}")
    if part := settings.get("part"):
        said.append(f"with the temperature of {part}")
    if entry := family_of(cause.family):
        said += entry.said(cause)
    if (reference := settings.get("reference")) and cause.signal:
        said.append(f"at {cause.signal} = {quantity(float(reference), str(settings.get('reference_unit', '')))}")
    if height := settings.get("height"):
        said.append(f"about {number(float(height))} m")
    return ", ".join(said)


def cause_words(cause: Cause | Rival) -> str:
    """As "missing heat source at bed.x_motor: 85 W (95 % interval 80 to 90 W), following x_current²"."""
    where = place_words(cause.place)
    entry = family_of(cause.family)
    if entry and entry.channel and where:
        head = f"{where} is at fault"
    else:
        link = "between" if Spot.read(cause.place).between else "in" if where.startswith("run ") else "at"
        link = "that follows" if entry and entry.weighed else link  # a missing member has a driver
        head = what(cause.family) + (f" {link} {where}" if where else "")
    size = size_words(cause.amplitude, cause.ci95, cause.unit)
    if size and (whose := times(cause.family, cause.unit)):
        size = f"{size} {whose}"
    if isinstance(cause, Cause) and (settings := setting_words(cause)):
        size = f"{size}, {settings}" if size else settings
    history = history_words(cause.history)
    if entry and entry.kind_told:
        said = [text for text in (history, size) if text]
    else:  # "x_current²" is a signal to follow; "from 4 h of run_1 on" says all
        said = [text for text in (size, f"following {history}" if history and " " not in history else history) if text]
    return head + (f": {', '.join(said)}" if said else "")


def limit_words(limit: Limit) -> str:
    return f"{what(limit.family)}, {sized(limit.family, limit.size, limit.unit)}"


def joined(items: Sequence[str]) -> str:
    """One sentence of several items, which hold commas of their own: a; b; and c."""
    if len(items) < 2:
        return "".join(items)
    return "; ".join(items[:-1]) + f"; and {items[-1]}"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def beyond(pulls: Sequence[Pull], sigmas: float) -> list[Pull]:
    """Parameters pulled further than so many prior standard deviations, the furthest first."""
    return sorted((p for p in pulls if abs(p.pull) > sigmas), key=lambda p: -abs(p.pull))


def pull_words(pull: Pull, ci95: tuple[float, float] = (math.nan, math.nan)) -> str:
    """`ci95`: 95 % interval of its value, where it is known."""
    return (
        f"{pull.path} is {size_words(pull.value, ci95, pull.unit)} instead of "
        f"{quantity(pull.nominal, pull.unit)} ({pull.pull:+.1f} prior standard deviations)"
    )


def pull_of(d: Diagnosis, cause: Cause) -> Pull | None:
    """The pull of the declared number that a cause is; None of other causes."""
    known = (
        p for p in d.pulls if p.path == cause.parameter or (p.freed and f"{p.path}.".startswith(f"{cause.place}."))
    )
    return next(known, None)


def verdict_sentence(d: Diagnosis) -> str:
    """The verdict in one sentence: what, where, how much, how sure."""
    causes = joined([cause_words(c) for c in d.causes])
    if d.verdict == "nothing":
        limits = _seen(d)
        seen = f"; detection limit (median location): {limit_words(limits[0])}" if limits else ""
        moved, left = moved_words(d), left_words(d)
        fits = "" if moved or left else ": the description explains them within their noise"
        if moved:
            head = f"{_sentence(moved)} With that, nothing else is missing that these data could show{seen}."
        else:
            head = f"Nothing is missing that these data could show{fits}{seen}."
        return f"{head} {_sentence(left)}" if left else head
    if d.verdict == "too_poor":
        return _sentence(next((n for n in d.notes if n.startswith("the model is too poor")), "the model is too poor"))
    if d.verdict == "unknown":
        return _sentence(_unknown_words(d) + (f"; named besides: {causes}" if causes else ""))
    if d.verdict == "out_of_tolerance":
        return _sentence(f"Wrong declared values: {_strained_words(d)}")
    if d.verdict == "ambiguous":
        return _sentence(_ambiguous_words(d))
    if not causes:
        return {
            "sensor": "A temperature sensor is at fault, not the machine.",
            "signal": "A logged signal is at fault, not the machine.",
        }.get(d.verdict, "A cause was found, and none is listed.")
    if d.verdict == "sensor":
        return _sentence(f"Not the machine, but its measurement: {causes}")
    if d.verdict == "signal":
        return _sentence(f"Not the machine, but what was logged of its loads: {causes}")
    causes = joined([cause_words(c) + _alike_words(c) for c in d.causes])
    if len(d.causes) == 1:
        return _sentence(causes)
    return _sentence(f"{len(d.causes)} causes act together: {causes}")


def alike(cause: Cause) -> list[str]:
    """Other places of its part at which these data would show the same cause as they do."""
    part = Spot.read(cause.place).owner
    return list(dict.fromkeys(
        r.place for r in cause.rivals
        if r.family == cause.family and r.place != cause.place and r.remedy and Spot.read(r.place).owner == part
    ))  # fmt: skip


def _alike_words(cause: Cause) -> str:
    others = alike(cause)
    return f" (data cannot separate {cause.place} from {' and '.join(others)})" if others else ""


def follows(d: Diagnosis) -> str:
    """What to do with a verdict."""
    if d.verdict == "unknown" and d.unknown is None:  # the sealed run refuted the name
        return "What was named does not predict the sealed run; see the notes."
    if d.verdict == "signal" and any(c.parameter for c in d.causes):
        return "No cause is added to the machine: machine.toml corrects the declaration of the signal."
    return _FOLLOWS[d.verdict]


def _strained_words(d: Diagnosis) -> str:
    numbers, besides = list[str](), list[str]()
    for c in d.causes:
        if (p := pull_of(d, c)) is None:
            besides.append(cause_words(c))
            continue
        one = p.nominal if c.unit == "1" else 1.0
        low, high = sorted(one * end for end in c.ci95)
        numbers.append(pull_words(replace(p, value=one * c.amplitude), (low, high)))
    if not numbers:
        return joined(besides or [pull_words(p) for p in beyond(d.pulls, 3.0)[:3]]) or "see the pulls"
    return joined(numbers) + (f"; besides: {joined(besides)}" if besides else "")


def _unknown_words(d: Diagnosis) -> str:
    if d.unknown is None:
        return "nothing in the catalogue explains the residuals"
    part, surface = d.unknown.part, d.unknown.surface
    besides = f", and also at {' and '.join(d.unknown.besides)}" if d.unknown.besides else ""
    hours = [
        (t, q, sigma, run) for run, (time, heat, spread) in d.unknown.history.items()
        for t, q, sigma in zip(time, heat, spread, strict=False) if abs(q) > 0.0
    ]  # fmt: skip
    at, largest, sigma, run = max(hours, key=lambda hour: abs(hour[1]), default=(0.0, 0.0, 0.0, ""))
    way = "leaves" if largest < 0.0 else "enters"
    text = f"heat {way} part {part}, mostly at {surface}{besides}, and nothing in the catalogue explains it"
    if not hours:
        return text
    most = abs(largest)
    middle, low, high, unit = interval_and_unit(most, most - SURE * sigma, most + SURE * sigma, "W")
    return f"{text}; its peak is {middle} {unit} (95 % interval {low} to {high} {unit}), {at / 3600:.1f} h into {run}"


def _ambiguous_words(d: Diagnosis) -> str:
    """The first cause that has rivals (a stuck sensor before it has none) and these, or the best candidates."""
    first = next((c for c in d.causes if c.rivals), d.causes[0] if d.causes else None)
    these: list[Cause | Rival] = [first, *first.rivals] if first else list(d.ranked[:2])
    if not these:
        return "something is missing, and these data cannot identify it"
    ways = "; or ".join(cause_words(c) for c in these[:3])
    more = f"; or {len(these) - 3} more" if len(these) > 3 else ""
    besides = joined([cause_words(c) for c in d.causes if c is not first])
    told = f"something is missing; these data fit either {ways}{more}"
    return told + (f"; besides: {besides}" if besides else "")


def remedies(d: Diagnosis) -> list[str]:
    """What to measure so that rivals come apart, each once."""
    others = [*(r for c in d.causes for r in c.rivals), *d.ranked]
    return list(dict.fromkeys(r.remedy for r in others if r.remedy))


def chance(nulls: np.ndarray | None, threshold: float) -> str:
    """How often data of a machine without an effect pass `threshold`; "" without simulated data sets."""
    values = np.asarray([] if nulls is None else nulls, dtype=float)
    values = values[np.isfinite(values)]
    n, above = len(values), int((values > threshold).sum())
    if not n or not math.isfinite(threshold):
        return ""
    # none of n: with 95 % confidence the rate is below 3 / n
    few = max(1, round(n / 3))
    rare = "" if above else f", so at most 1 in {few} machines within its tolerances would (95 % confidence)"
    return (
        f"{above or 'None'} of {n} simulated fault-free data sets exceeded "
        f"{number(threshold)}{rare}; the largest gave {number(float(values.max()))}."
    )


def evidence_sentence(d: Diagnosis, family: str, statistic: float, threshold: float) -> str:
    """The statistic of one finding against its threshold, in plain words."""
    text = f"The statistic is {number(statistic)}, its threshold {number(threshold)}."
    return f"{text} {chance(d.nulls.get(family), threshold)}".strip()


def cause_evidence(d: Diagnosis, c: Cause) -> str:
    """What speaks for a cause; a rate of chance only where it was judged by what synthetic measurements gave."""
    if c.history in _SEEN:
        longest = max((w.end - w.start for w in c.windows), default=math.nan)
        at = min((w.start for w in c.windows), default=math.nan)
        figures = {"hours": number(longest / 3600.0), "size": number(c.amplitude), "at": number(at / 3600.0)}
        return f"{_SEEN[c.history].format(**figures)}; this needs no statistic."
    entry = family_of(c.family)
    if entry and entry.weighed:
        gain, strong = number(c.statistic / 2.0), number(c.threshold / 2.0)
        return f"With it, and those before it, the logarithm of the evidence is {gain} larger; {strong} is strong."
    if c.history.endswith(REFUTED):
        return f"All other channels refute it: statistic {number(c.statistic)}, threshold {number(c.threshold)}."
    if c.threshold == d.thresholds.get(c.family, c.threshold):
        asked = not (entry and entry.last(c))
        return evidence_sentence(d, c.family if asked else "", c.statistic, c.threshold)
    # a declared number: both are squares, of its distance from the declared one
    far, needed = (number(math.sqrt(max(v, 0.0))) for v in (c.statistic, c.threshold))
    if c.history == "always":  # freed of its tolerance
        return f"It lies {far} standard deviations of its fit from the declared value; the threshold is {needed}."
    return f"Calibration shifts it by {far} times the 97 % quantile of simulated fault-free data sets."


def when(cause: Cause) -> str:
    """The history in words, with the windows where it is made of them."""
    parts = [
        f"{w.start / 3600:.1f} h to {w.end / 3600:.1f} h of {w.run}" + (f" at {w.level:.2g}" if w.level != 1.0 else "")
        for w in cause.windows[:6]
    ]
    more = [f"and {len(cause.windows) - 6} more"] if len(cause.windows) > 6 else []
    return "; ".join([history_words(cause.history) or "always", *parts, *more])


def support_words(support: Support) -> str:
    """How many channels carry the first cause, and which."""
    strongest = [f"{name} {100 * share:.0f} %" for name, share in support.shares[:3] if share >= LEAST_SHARE]
    n = number(support.participation, 1)
    return f"Effective channels (participation ratio): {n}. Largest: {', '.join(strongest)}."


def evidence_lines(d: Diagnosis) -> list[str]:
    """The evidence of the verdict, what follows from it, and what would separate rivals."""
    several = len(d.causes) > 1
    lines = [(f"{c.place}: " if several else "") + cause_evidence(d, c) for c in d.causes]
    lines += [support_words(d.support)] if d.support else []
    if d.unknown and not d.causes:
        lines.append(evidence_sentence(d, "unknown", d.unknown.statistic, d.unknown.threshold))
    if d.verdict in ("sensor", "signal"):
        lines.append(follows(d))
    if d.verdict in ("ambiguous", "named") and remedies(d):
        lines.append(f"To separate rivals: {remedies(d)[0]}")
    return lines


def unknown_lines(d: Diagnosis) -> list[str]:
    if not d.unknown or not d.unknown.correlated_signals:
        return []
    name, correlation = d.unknown.correlated_signals[0]
    if abs(correlation) < LINKED:
        return [f"No logged signal goes with the unexplained heat: {name} does most (correlation {correlation:+.2f})."]
    way = "with" if correlation > 0.0 else "against"
    return [f"The unexplained heat goes {way} {name} (correlation {correlation:+.2f})."]


def pull_lines(d: Diagnosis) -> list[str]:
    far = [] if d.verdict == "out_of_tolerance" else beyond(d.pulls, 2.0)
    beside = " (beside unknown heat they may have absorbed some of it)" if d.verdict == "unknown" else ""
    return [f"Check: {joined([pull_words(p) for p in far[:2]])}{beside}."] if far else []


def _seen(d: Diagnosis) -> list[Limit]:
    """The limits of what can be seen at half of all places."""
    return [x for x in d.detection_limits if math.isfinite(x.size)]


def limit_lines(d: Diagnosis) -> list[str]:
    of_family = dict[str, list[Limit]]()
    for x in _seen(d)[:5]:  # of a film as a factor, and in W/(m^2 K) of a surface
        of_family.setdefault(x.family, []).append(x)
    shown = joined([
        " or ".join([limit_words(first), *(sized(x.family, x.size, x.unit) for x in others)])
        for first, *others in of_family.values()
    ])  # fmt: skip
    return [f"Detection limits (median location, probability 95 %): {shown}."] if shown else []


def whiteness_lines(d: Diagnosis) -> list[str]:
    before, after = (np.array([w[k] for w in d.whiteness], dtype=float) for k in (1, 2))
    if not np.isfinite(before).any() or not np.isfinite(after).any():
        return []
    return [
        f"Lag-1 autocorrelation of residuals: {np.nanmedian(after):.2f} (median over channels; "
        f"{np.nanmedian(before):.2f} before)."
    ]


def gain_lines(d: Diagnosis) -> list[str]:
    """What the extended model brings on each sealed run: the channels that the causes move, then the others."""
    result, runs = [], list(dict.fromkeys(g.run for g in d.gain))
    extended = "with what was withdrawn" if any(n.startswith("withdrawn: ") for n in d.notes) else "extended"
    others = " that they do not move" if any(g.affected for g in d.gain) else ""
    groups = product(runs, ((True, " that the causes move"), (False, others)), MEASURED)
    for run, (affected, which), (unit, name) in groups:
        known = (g for g in d.gain if np.isfinite([g.delivered, g.recalibrated, g.extended]).all())
        these = [g for g in known if g.run == run and g.affected == affected and g.unit == unit]
        if not these:
            continue
        rows = np.array([[g.delivered, g.recalibrated, g.extended] for g in these], dtype=float)
        a, b, c = (quantity(v, unit) for v in rms(rows).tolist())
        head = f"Sealed run {run}" if len(runs) > 1 else "Sealed run"
        counted = f"{len(these)} {name}{'s' if len(these) > 1 else ''}"
        better, worse = sum(g.ci95[0] > 0 for g in these), sum(g.ci95[1] < 0 for g in these)
        lost = [g.channel for g in these if g.ci95_delivered[1] < 0.0]
        result.append(
            f"{head}: {counted}{which}: {a} as delivered, {b} recalibrated, {c} {extended} (root mean square, "
            f"noise included); significantly better in {better}, worse in {worse}"
            + (f"; worse than as delivered: {', '.join(lost)}." if lost else ".")
        )
    return result


def no_gain(d: Diagnosis) -> str:
    """Why there is none."""
    sealed = any(s.sealed for s in d.series)
    why = "nothing was measured in the sealed run" if sealed else "no run was sealed"
    return f"There is no gain to report: {why}."
