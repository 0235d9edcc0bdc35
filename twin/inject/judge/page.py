"""The page of a campaign: its figures, who was taken for whom, and what was said wrongly, as tables in Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from twin.inject.draw.trial import NULLS
from twin.inject.judge.figures import SIZES, Limit, Result, detected, goals, per_family, place_right, several, truth_of
from twin.inject.judge.match import Known, lead, said


def page(results: Sequence[Result], limits: Sequence[Limit], known: Known, machine: str) -> str:
    """All tables in Markdown, of a campaign that may be unfinished. machine: its name."""
    wrong = Counter(str(r["error"]).partition(":")[0] for r in results if "error" in r)
    header, rows = confusion(results, known)
    parts = [
        "# Campaign\n",
        f"{len(results)} trials on {machine}, {sum(wrong.values())} of them failed"
        + (f" ({', '.join(f'{k} {n} times' for k, n in wrong.items())})" if wrong else "")
        + ". A failed trial is not detected, and no alarm. Intervals are Clopper-Pearson, 95 %, two-sided.\n",
        "## Goals\n", _table(("figure", "value", "95 % interval", "trials", "failed", "goal"),
                             goals(results, limits, known)),
        "\n## Families\n",
        "Detected: any verdict but nothing. Family, place, part: of the detected. Covered: sizes within their",
        "interval, of those that can be compared. Recovered: median share of the reducible held-out variance, and of\n"
        "how many trials.\n",
        _table(("family", "trials", "failed", *(f"detected, {word}" for _, word in SIZES), "family", "place", "part",
                "unknown", "covered", "recovered"), per_family(results, known)),
        "\n## Confusion matrix\n", "Sizes nominal and twice. The family of the first cause, or the verdict.\n",
        _table(header, rows),
    ]  # fmt: skip
    if more := several(results, known):
        head = ["trials of", "trials", "failed", "all named", "one named", "ambiguous"]
        parts += ["\n## Several at once, and hard to distinguish\n", _table(head, more)]
    if wrong_ones := mistakes(results, known):
        head = ["hidden", "seed", "diagnosed first", "place, history", "size", "statistic"]
        parts += ["\n## False alarms, wrong names and wrong places\n", _table(head, wrong_ones)]
    stated = [[m.family, m.unit, f"{m.size:.3g}", f"{m.smallest:.3g}", f"{m.largest:.3g}", m.place] for m in limits]
    if stated:
        head = ["family", "unit", "median", "smallest", "largest", "place of the median"]
        parts += ["\n## Detection limits\n", _table(head, stated)]
    return "\n".join(parts) + "\n"


def mistakes(results: Sequence[Result], known: Known) -> list[list[str]]:
    """Rows of false alarms and of wrong names or places: hidden, seed, what was diagnosed first, its size and
    statistic.
    """
    rows = []
    for r in results:
        if "error" in r:
            rows.append([_hidden(r), str(r["seed"]), "error", str(r["error"]), "", ""])
            continue
        wrong = (
            detected(r) and not place_right(r, known)
            if r["family"] in known.families
            else r["family"] in NULLS and detected(r)
        )
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
    truth = truth_of(r)
    return f"{truth['family']} {truth['place']}, {truth['history']}, {truth['size']:.3g} {truth['unit']}".removesuffix(
        " 1"
    )


def confusion(results: Sequence[Result], known: Known) -> tuple[list[str], list[list[str]]]:
    """Header and rows: what was hidden against what was diagnosed, a family or a verdict; nominal and twice sizes."""
    chosen = [r for r in results if r["factor"] >= 1.0]
    order = [*known.families, "nothing", "unknown", "error"]
    words = {said(r) for r in chosen}
    columns = [w for w in order if w in words] + sorted(words - set(order))
    truths = dict.fromkeys([*known.families, *(r["family"] for r in chosen)])
    rows = []
    for truth in truths:
        own = Counter(said(r) for r in chosen if r["family"] == truth)
        if own:
            rows.append([truth, *(str(own[c]) if own[c] else "" for c in columns)])
    return ["hidden \\ diagnosed", *columns], rows


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(header)} |", f"|{'---|' * len(header)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])
