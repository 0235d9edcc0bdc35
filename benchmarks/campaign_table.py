"""The figures of a campaign: what was detected, named, measured and gained, with the trials behind every figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import beta

from benchmarks.campaign_match import Top, covered, described, effect, lead, said, same_part, same_place
from twin.atomic import atomic_path
from twin.diagnose.catalogue import FAMILIES
from twin.diagnose.diagnosis import Limit

Result = Mapping[str, Any]
CATALOGUE = tuple(f.name for f in FAMILIES)
NULLS = ("null", "null_law")
PREDICTS = tuple(f.name for f in FAMILIES if f.group in ("machine", "signal"))  # whose extension is a better model
REDUCIBLE = 0.05  # of the variance without the hidden thing: a smaller part is not worth recovering
SHOWN = 100.0  # sum of squares of what is hidden, in units of noise, from which data show it at all
SIZES = ((1.0, "nominal"), (0.5, "half"), (2.0, "twice"))


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


def _truth(r: Result) -> Mapping[str, Any]:
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


def place_right(r: Result) -> bool:
    """Family and place of the first cause are right."""
    first = lead(r)
    return family_right(r) and first is not None and same_place(_truth(r), first)


def recovered(r: Result) -> float | None:
    """Share of the reducible held-out variance that the extension takes away.

    Reducible is what the sealed run's residuals have more than those of the same machine, air and noise without the
    hidden thing, both recalibrated. None where that is hardly any, where the instrument was at fault and not the
    machine, and where the hidden thing comes and goes in the sealed run unlogged: no model can foresee that.
    """
    if r["family"] not in PREDICTS or any(t["history"] == "in windows" for t in r["truth"]):
        return None
    before, after, clean = r["variance"]
    reducible = before - clean
    return float((before - after) / reducible) if reducible > REDUCIBLE * clean else None


def _recoveries(trials: Sequence[Result]) -> list[float]:
    found = [recovered(r) for r in trials if place_right(r)]
    return [f for f in found if f is not None]


def _coverage(trials: Sequence[Result], top: Top) -> Share:
    """Of named and rightly placed causes with comparable sizes, those whose interval holds the size."""
    held = [covered(_truth(r), r["causes"][0], top) for r in trials if place_right(r)]
    known = [h for h in held if h is not None]
    return Share(sum(known), len(known))


def goals(results: Sequence[Result], limits: Sequence[Limit], top: Top, tables: Mapping[str, Any]) -> list[list[str]]:
    """Rows: figure, value, 95 % interval, trials, errors, goal."""
    known = [r for r in results if r["family"] in CATALOGUE]
    nulls = [r for r in results if r["family"] in NULLS]
    outside = [r for r in results if r["family"] == "outside"]
    seen = [r for r in known if detected(r)]
    rows: list[list[str]] = []

    def row(name: str, s: Share, goal: str = "") -> None:
        rows.append([name, s.text, s.interval, s.of, str(s.errors), goal])

    alarms = share(nulls, detected)
    row("false alarms", alarms, "<= 0.05")
    bound = f"{upper(alarms.k, alarms.n):.3f}" if alarms.n else "-"
    rows.append(["false alarms, upper 95 % bound", bound, "", alarms.of, str(alarms.errors), "<= 0.08"])
    kinds = Counter(str(r["verdict"]) for r in nulls if detected(r))
    for kind, n in sorted(kinds.items()):
        row(f"false alarms: {kind}", Share(n, alarms.n, alarms.errors))
    for name in NULLS:
        row(f"false alarms of {name}", share([r for r in nulls if r["family"] == name], detected))
    row("family right, of detected", share(seen, family_right), ">= 0.95")
    row("family right or in the ambiguous set", share(seen, in_set))
    row("place right, of detected", share(seen, place_right), ">= 0.90")
    row("part right, of detected", share(seen, lambda r: _part_right(r, tables)))
    for factor, word in SIZES:
        goal = ">= 0.80" if factor == 1.0 else ""
        own = [r for r in known if r["factor"] == factor]
        row(f"detected at {word} size", share(own, detected), goal)
        shown = [r for r in own if r.get("present", np.inf) > SHOWN]
        row(f"detected at {word} size, of what the data show", share(shown, detected))
    row("detected at twice the stated limit and more", share(_beyond(known, limits, top), detected), ">= 0.95")
    row("outside the catalogue: flagged unknown", share(outside, lambda r: r["verdict"] == "unknown"), ">= 0.90")
    row("outside the catalogue: right part", share(outside, _unknown_part), ">= 0.80")
    row("false unknown, cause in the catalogue", share(known, lambda r: r["verdict"] == "unknown"), "<= 0.05")
    row("size within its 95 % interval", _coverage(seen, top), ">= 0.90")
    shares = _recoveries(known)
    value = f"{np.median(shares):.3f}" if shares else "-"
    quartiles = f"{np.quantile(shares, 0.25):.3f} to {np.quantile(shares, 0.75):.3f} (quartiles)" if shares else "-"
    rows.append(["reducible held-out variance recovered (median)", value, quartiles, str(len(shares)), "0", ">= 0.80"])
    seconds = [r["seconds"] for r in results if "seconds" in r]
    median = f"{np.median(seconds):.1f}" if seconds else "-"
    most = f"largest {max(seconds):.1f}" if seconds else "-"
    rows.append(["seconds per diagnosis, yardstick ready (median)", median, most, str(len(seconds)), "0", "<= 300"])
    return rows


def _part_right(r: Result, tables: Mapping[str, Any]) -> bool:
    first = lead(r)
    return family_right(r) and first is not None and same_part(_truth(r), first, tables)


def _unknown_part(r: Result) -> bool:
    return bool(r["unknown"]) and r["unknown"][0] == _truth(r)["place"].partition(".")[0]


def _beyond(known: Sequence[Result], limits: Sequence[Limit], top: Top) -> list[Result]:
    """Trials whose hidden size is at least twice the limit that is stated for its place; without that, its family."""
    table = {(m.family, m.unit): m.size for m in limits}
    result = []
    for r in known:
        if "error" in r:
            continue
        truth = _truth(r)
        unit = "K/day" if truth["unit"] == "K/s" else truth["unit"]
        own = (r.get("limits") or [None])[0]
        limit = table.get((truth["family"], unit)) if own is None else own
        if limit is not None and effect(truth, top) >= 2.0 * limit:
            result.append(r)
    return result


def per_family(results: Sequence[Result], top: Top, tables: Mapping[str, Any]) -> list[list[str]]:
    """Rows of families: trials, errors, detected by size, then of the detected family, place, part, coverage, gain."""
    rows = []
    for family in CATALOGUE:
        own = [r for r in results if r["family"] == family]
        if not own:
            continue
        seen = [r for r in own if detected(r)]
        of_size = [share([r for r in own if r["factor"] == factor], detected).of for factor, _ in SIZES]
        shares = _recoveries(own)
        rows.append([
            family, str(len(own)), str(sum("error" in r for r in own)), *of_size,
            share(seen, family_right).of, share(seen, place_right).of, share(seen, lambda r: _part_right(r, tables)).of,
            share(own, lambda r: r["verdict"] == "unknown").of, _coverage(seen, top).of,
            f"{np.median(shares):.2f} ({len(shares)})" if shares else "-",
        ])  # fmt: skip
    return rows


def several(results: Sequence[Result]) -> list[list[str]]:
    """Rows of trials with more than one thing hidden, or two that data hardly tell apart."""
    rows = []
    for name in ("pair", "two", "effect_and_sensor"):
        own = [r for r in results if r["family"] == name]
        if own:
            every = share(own, lambda r: all(_named(t, r) for t in r["truth"]))
            some = share(own, lambda r: any(_named(t, r) for t in r["truth"]))
            ambiguous = share(own, lambda r: r["verdict"] == "ambiguous")
            rows.append([name, str(len(own)), str(every.errors), every.of, some.of, ambiguous.of])
    return rows


def _named(truth: Mapping[str, Any], r: Result) -> bool:
    return any(c["family"] == truth["family"] and same_place(truth, c) for c in r["causes"])


def mistakes(results: Sequence[Result]) -> list[list[str]]:
    """Rows of false alarms and of wrong names or places: hidden, seed, what was said first, its size and statistic."""
    rows = []
    for r in results:
        if "error" in r:
            rows.append([_hidden(r), str(r["seed"]), "error", str(r["error"]), "", ""])
            continue
        wrong = detected(r) and not place_right(r) if r["family"] in CATALOGUE else r["family"] in NULLS and detected(r)
        if not wrong:
            continue
        first = lead(r)
        if r["verdict"] == "unknown":
            rows.append([_hidden(r), str(r["seed"]), "unknown", str((r["unknown"] or [""])[0]), "", ""])
        elif first is not None:
            size = f"{first['amplitude']:.3g} {first['unit']}"
            place = f"{first['place']}, {first['history']}"
            rows.append([_hidden(r), str(r["seed"]), str(first["family"]), place, size, f"{first['statistic']:.0f}"])
    return rows


def _hidden(r: Result) -> str:
    if not r.get("truth"):
        return str(r["family"])
    truth = _truth(r)
    return f"{truth['family']} {truth['place']}, {truth['history']}, {truth['size']:.3g} {truth['unit']}".removesuffix(
        " 1"
    )


def confusion(results: Sequence[Result]) -> tuple[list[str], list[list[str]]]:
    """Header and rows: what was hidden against what was said, a family or a verdict; nominal and twice sizes."""
    chosen = [r for r in results if r["factor"] >= 1.0]
    order = [*CATALOGUE, "nothing", "unknown", "error"]
    words = {said(r) for r in chosen}
    columns = [w for w in order if w in words] + sorted(words - set(order))
    truths = dict.fromkeys([*CATALOGUE, *(r["family"] for r in chosen)])
    rows = []
    for truth in truths:
        own = Counter(said(r) for r in chosen if r["family"] == truth)
        if own:
            rows.append([truth, *(str(own[c]) if own[c] else "" for c in columns)])
    return ["hidden \\ said", *columns], rows


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(header)} |", f"|{'---|' * len(header)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


@cache
def largest(name: str) -> float:
    """Of a logged signal in all runs of a trial."""
    from benchmarks.hidden_parts import signal

    return max(float(signal(r, name).max()) for r in range(3))


def page(results: Sequence[Result], limits: Sequence[Limit], model: Path, top: Top = largest) -> str:
    """All tables in Markdown, of a campaign that may be unfinished. model: folder of the machine's description."""
    tables = described(model)
    wrong = Counter(str(r["error"]).partition(":")[0] for r in results if "error" in r)
    header, rows = confusion(results)
    parts = [
        "# Campaign\n",
        f"{len(results)} trials on {model.name}, {sum(wrong.values())} of them failed"
        + (f" ({', '.join(f'{k} {n} times' for k, n in wrong.items())})" if wrong else "")
        + ". A failed trial is not detected, and no alarm. Intervals are Clopper-Pearson, 95 %, two-sided.\n",
        "## Goals\n", _table(("figure", "value", "95 % interval", "trials", "failed", "goal"),
                             goals(results, limits, top, tables)),
        "\n## Families\n",
        "Detected: any verdict but nothing. Family, place, part: of the detected. Covered: sizes within their",
        "interval, of those that can be compared. Recovered: median share of the reducible held-out variance, and of\n"
        "how many trials.\n",
        _table(("family", "trials", "failed", *(f"detected, {word}" for _, word in SIZES), "family", "place", "part",
                "unknown", "covered", "recovered"), per_family(results, top, tables)),
        "\n## Hidden against said\n", "Sizes nominal and twice. The family of the first cause, or the verdict.\n",
        _table(header, rows),
    ]  # fmt: skip
    if more := several(results):
        head = ["trials of", "trials", "failed", "all named", "one named", "ambiguous"]
        parts += ["\n## Several at once, and hard to tell apart\n", _table(head, more)]
    if wrong_ones := mistakes(results):
        head = ["hidden", "seed", "said first", "place, history", "size", "statistic"]
        parts += ["\n## False alarms, wrong names and wrong places\n", _table(head, wrong_ones)]
    stated = [[m.family, m.unit, f"{m.size:.3g}", f"{m.smallest:.3g}", f"{m.largest:.3g}", m.place] for m in limits]
    if stated:
        head = ["family", "unit", "median", "smallest", "largest", "place of the median"]
        parts += ["\n## Detection limits\n", _table(head, stated)]
    return "\n".join(parts) + "\n"


def write_tables(results: list[dict[str, Any]], limits: tuple[Limit, ...], out: Path, model: Path) -> None:
    """Print the tables and write out/tables.md. model: folder of the machine's description."""
    text = page(results, limits, model)
    print(text, flush=True)
    with atomic_path(out / "tables.md") as temporary:
        temporary.write_text(text, encoding="utf-8")
