"""The figures of a campaign: what was detected, named, measured and gained, with the trials behind every figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from scipy.stats import beta

from twin.inject.draw.trial import NULLS
from twin.inject.judge.match import Known, covered, effect, lead, said, same_part, same_place

Result = Mapping[str, Any]
REDUCIBLE = 0.05  # of the variance without the hidden thing: a smaller part is not worth recovering
SHOWN = 100.0  # sum of squares of what is hidden, in units of noise, from which data show it at all
SIZES = ((1.0, "nominal"), (0.5, "half"), (2.0, "twice"))


class Limit(Protocol):
    """The detection limit of a family, as a diagnosis states it."""

    @property
    def family(self) -> str: ...
    @property
    def place(self) -> str: ...  # with the median limit of the family
    @property
    def size(self) -> float: ...  # median over places, in `unit`
    @property
    def smallest(self) -> float: ...
    @property
    def largest(self) -> float: ...
    @property
    def unit(self) -> str: ...


@dataclass(frozen=True)
class Share:
    """k of n trials; errors among them count against the figure."""

    k: int
    n: int
    errors: int = 0

    @property
    def text(self) -> str:
        return f"{self.k / self.n:.3f}" if self.n else "-"

    @property
    def of(self) -> str:
        return f"{self.k} of {self.n}"

    @property
    def interval(self) -> str:
        if not self.n:
            return "-"
        return f"{lower(self.k, self.n, 0.025):.3f} to {upper(self.k, self.n, 0.025):.3f}"


def upper(k: int, n: int, alpha: float = 0.05) -> float:
    """One-sided upper bound of confidence 1 - alpha of a share of which k of n were seen (Clopper, Pearson 1934)."""
    return 1.0 if k >= n else float(beta.ppf(1.0 - alpha, k + 1, n - k))


def lower(k: int, n: int, alpha: float = 0.05) -> float:
    """The lower one."""
    return 0.0 if k <= 0 else float(beta.ppf(alpha, k, n - k + 1))


def share(trials: Iterable[Result], good: Callable[[Result], bool]) -> Share:
    """Of trials those that are good; a trial that failed is not."""
    every = list(trials)
    errors = sum("error" in r for r in every)
    return Share(sum("error" not in r and good(r) for r in every), len(every), errors)


def detected(r: Result) -> bool:
    """Anything was said at all."""
    return "error" not in r and r["verdict"] != "nothing"


def truth_of(r: Result) -> Mapping[str, Any]:
    truth: Mapping[str, Any] = r["truth"][0]
    return truth


def family_right(r: Result) -> bool:
    """The first cause is of the hidden family."""
    return detected(r) and said(r) == r["family"]


def in_set(r: Result) -> bool:
    """The hidden family is the first cause's, or an ambiguous verdict lists it."""
    first = lead(r)
    rivals = [family for family, _ in first["rivals"]] if first and r["verdict"] == "ambiguous" else []
    return family_right(r) or (detected(r) and r["family"] in rivals)


def place_right(r: Result, known: Known) -> bool:
    """Family and place of the first cause are right."""
    first = lead(r)
    return family_right(r) and first is not None and same_place(truth_of(r), first, known)


def recovered(r: Result, known: Known) -> float | None:
    """Share of the reducible held-out variance that the extension takes away.

    Reducible is what the sealed run's residuals have more than those of the same machine, air and noise without the
    hidden thing, both recalibrated. None where that is hardly any, where the instrument was at fault and not the
    machine, and where the hidden thing switches in the sealed run unlogged: no model can foresee that.
    """
    if r["family"] not in known.predicts or any(t["history"] == "in windows" for t in r["truth"]):
        return None
    before, after, clean = r["variance"]
    reducible = before - clean
    return float((before - after) / reducible) if reducible > REDUCIBLE * clean else None


def _recoveries(trials: Sequence[Result], known: Known) -> list[float]:
    found = [recovered(r, known) for r in trials if place_right(r, known)]
    return [f for f in found if f is not None]


def _coverage(trials: Sequence[Result], known: Known) -> Share:
    """Of named and rightly placed causes with comparable sizes, those whose interval holds the size."""
    held = [covered(truth_of(r), r["causes"][0], known) for r in trials if place_right(r, known)]
    compared = [h for h in held if h is not None]
    return Share(sum(compared), len(compared))


def goals(results: Sequence[Result], limits: Sequence[Limit], known: Known) -> list[list[str]]:
    """Rows: figure, value, 95 % interval, trials, errors, goal."""
    inside = [r for r in results if r["family"] in known.families]
    outside = [r for r in results if r["family"] == "outside"]
    seen = [r for r in inside if detected(r)]
    return [
        *_false_alarms([r for r in results if r["family"] in NULLS]),
        _row("family right, of detected", share(seen, family_right), ">= 0.95"),
        _row("family right or in the ambiguous set", share(seen, in_set)),
        _row("place right, of detected", share(seen, lambda r: place_right(r, known)), ">= 0.90"),
        _row("part right, of detected", share(seen, lambda r: _part_right(r, known))),
        *_by_size(inside),
        _row("detected at twice the stated limit and more", share(_beyond(inside, limits, known), detected), ">= 0.95"),
        _row("outside the catalogue: flagged unknown", share(outside, _unknown), ">= 0.90"),
        _row("outside the catalogue: right part", share(outside, _unknown_part), ">= 0.80"),
        _row("false unknown, cause in the catalogue", share(inside, _unknown), "<= 0.05"),
        _row("size within its 95 % interval", _coverage(seen, known), ">= 0.90"),
        _recovery(_recoveries(inside, known)),
        _seconds([r["seconds"] for r in results if "seconds" in r]),
    ]


def _row(name: str, s: Share, goal: str = "") -> list[str]:
    return [name, s.text, s.interval, s.of, str(s.errors), goal]


def _false_alarms(nulls: Sequence[Result]) -> list[list[str]]:
    alarms = share(nulls, detected)
    bound = f"{upper(alarms.k, alarms.n):.3f}" if alarms.n else "-"
    kinds = Counter(str(r["verdict"]) for r in nulls if detected(r))
    return [
        _row("false alarms", alarms, "<= 0.05"),
        ["false alarms, upper 95 % bound", bound, "", alarms.of, str(alarms.errors), "<= 0.08"],
        *(_row(f"false alarms: {kind}", Share(n, alarms.n, alarms.errors)) for kind, n in sorted(kinds.items())),
        *(
            _row(f"false alarms of {name}", share([r for r in nulls if r["family"] == name], detected))
            for name in NULLS
        ),
    ]


def _by_size(inside: Sequence[Result]) -> list[list[str]]:
    rows = []
    for factor, word in SIZES:
        own = [r for r in inside if r["factor"] == factor]
        shown = [r for r in own if r.get("present", np.inf) > SHOWN]
        rows.append(_row(f"detected at {word} size", share(own, detected), ">= 0.80" if factor == 1.0 else ""))
        rows.append(_row(f"detected at {word} size, of what the data show", share(shown, detected)))
    return rows


def _recovery(shares: Sequence[float]) -> list[str]:
    value = f"{np.median(shares):.3f}" if shares else "-"
    quartiles = f"{np.quantile(shares, 0.25):.3f} to {np.quantile(shares, 0.75):.3f} (quartiles)" if shares else "-"
    return ["reducible held-out variance recovered (median)", value, quartiles, str(len(shares)), "0", ">= 0.80"]


def _seconds(seconds: Sequence[float]) -> list[str]:
    median = f"{np.median(seconds):.1f}" if seconds else "-"
    most = f"largest {max(seconds):.1f}" if seconds else "-"
    return ["seconds per diagnosis, thresholds ready (median)", median, most, str(len(seconds)), "0", "<= 300"]


def _unknown(r: Result) -> bool:
    return bool(r["verdict"] == "unknown")


def _part_right(r: Result, known: Known) -> bool:
    first = lead(r)
    return family_right(r) and first is not None and same_part(truth_of(r), first, known)


def _unknown_part(r: Result) -> bool:
    return bool(r["unknown"]) and r["unknown"][0] == truth_of(r)["place"].partition(".")[0]


def _beyond(results: Sequence[Result], limits: Sequence[Limit], known: Known) -> list[Result]:
    """Trials whose hidden size is at least twice the limit that is stated for its place; without that, its family."""
    table = {(m.family, m.unit): m.size for m in limits}
    result = []
    for r in results:
        if "error" in r:
            continue
        truth = truth_of(r)
        unit = "K/day" if truth["unit"] == "K/s" else truth["unit"]
        own = (r.get("limits") or [None])[0]
        limit = table.get((truth["family"], unit)) if own is None else own
        if limit is not None and effect(truth, known) >= 2.0 * limit:
            result.append(r)
    return result


def per_family(results: Sequence[Result], known: Known) -> list[list[str]]:
    """Rows of families: trials, errors, detected by size, then of the detected family, place, part, coverage, gain."""
    rows = []
    for family in known.families:
        own = [r for r in results if r["family"] == family]
        if not own:
            continue
        seen = [r for r in own if detected(r)]
        of_size = [share([r for r in own if r["factor"] == factor], detected).of for factor, _ in SIZES]
        shares = _recoveries(own, known)
        rows.append([
            family, str(len(own)), str(sum("error" in r for r in own)), *of_size,
            share(seen, family_right).of, share(seen, lambda r: place_right(r, known)).of,
            share(seen, lambda r: _part_right(r, known)).of, share(own, lambda r: r["verdict"] == "unknown").of,
            _coverage(seen, known).of,
            f"{np.median(shares):.2f} ({len(shares)})" if shares else "-",
        ])  # fmt: skip
    return rows


def several(results: Sequence[Result], known: Known) -> list[list[str]]:
    """Rows of trials with more than one thing hidden, or two that data hardly distinguish."""
    rows = []
    for name in ("pair", "two", "effect_and_sensor"):
        own = [r for r in results if r["family"] == name]
        if own:
            every = share(own, lambda r: all(_named(t, r, known) for t in r["truth"]))
            some = share(own, lambda r: any(_named(t, r, known) for t in r["truth"]))
            ambiguous = share(own, lambda r: r["verdict"] == "ambiguous")
            rows.append([name, str(len(own)), str(every.errors), every.of, some.of, ambiguous.of])
    return rows


def _named(truth: Mapping[str, Any], r: Result, known: Known) -> bool:
    return any(c["family"] == truth["family"] and same_place(truth, c, known) for c in r["causes"])
