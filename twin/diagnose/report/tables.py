"""The tables of the page of a diagnosis. All text is escaped here."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape

from twin.diagnose.faults.table import what
from twin.diagnose.report.text import history_words, place_words, sized
from twin.diagnose.result.diagnosis import Diagnosis, Rival
from twin.diagnose.result.numbers import interval_and_unit, number, quantity, size_words

MANY = 60  # rows that a table shows at most


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """A table with a head; columns in `numbers` are set right. Cells are plain text; empty without a row."""
    rows = list(rows)
    if not rows:
        return ""
    kinds = [' class="number"' if k in numbers else "" for k in range(len(head))]
    shown = "\n".join(
        "<tr>" + "".join(f"<td{kind}>{escape(cell)}</td>" for kind, cell in zip(kinds, row, strict=True)) + "</tr>"
        for row in rows[:MANY]
    )
    more = f"<p>{len(rows) - MANY} more in report.json.</p>" if len(rows) > MANY else ""
    titles = "".join(f"<th{kind}>{escape(title)}</th>" for kind, title in zip(kinds, head, strict=True))
    return f'<div class="wide"><table><thead><tr>{titles}</tr></thead><tbody>\n{shown}\n</tbody></table></div>{more}'


def items(texts: Iterable[str]) -> str:
    """A list of plain texts, empty of none."""
    told = "\n".join(f"<li>{escape(text)}</li>" for text in texts)
    return f"<ul>\n{told}\n</ul>" if told else ""


def folded(summary: str, html: str) -> str:
    """What a reader opens who wants to know: a line that says what it is, over escaped HTML."""
    return f"<details><summary>{escape(summary)}</summary>\n{html}\n</details>" if html else ""


def channels_table(d: Diagnosis) -> str:
    """How every channel is met and what of it counted: those with something wrong first, then those met worst."""
    order = sorted(d.channels, key=lambda r: (not (r["wrong"] or r["leaps"]), r["kept"] >= 0.9, -(r["rms"] or 0.0)))
    rows = []
    for r in order:
        rms = "-" if r["rms"] is None else f"{r['rms']:.3f} K" if r["unit"] == "K" else f"{1e6 * r['rms']:.2f} um"
        rows.append([r["channel"], r["run"], rms, f"{100 * r['kept']:.0f} %", str(r["leaps"]), r["wrong"]])
    head = ["channel", "run", "rms residual", "kept", "leaps", "what is wrong"]
    return table(head, rows, (2, 3, 4))


def rivals_table(rivals: Sequence[Rival], d: Diagnosis) -> str:
    """Candidates or rivals, each with the threshold of its family."""
    rows = []
    for k, r in enumerate(rivals):
        row = [str(k + 1), what(r.family), place_words(r.place), history_words(r.history) or "always"]
        row += [size_words(r.amplitude, r.ci95, r.unit) or "-", number(r.statistic)]
        row += [number(d.thresholds.get(r.family, math.nan))]
        rows.append([*row, f"{r.cosine:.2f}" if math.isfinite(r.cosine) else "-"])
    head = ["", "what", "where", "when", "size", "statistic", "threshold", "cosine"]
    return table(head, rows, range(4, len(head)))


def limits_table(d: Diagnosis) -> str:
    rows = []
    for x in d.detection_limits:
        sizes = [
            sized(x.family, v, x.unit) if math.isfinite(v) else "at no size that a machine can have"
            for v in (x.size, x.smallest, x.largest)
        ]
        rows.append([what(x.family), *sizes, place_words(x.place)])
    head = ["what", "limit (median location)", "at the best place", "at the worst place", "place of the median"]
    return table(head, rows, (1, 2, 3))


def gain_table(d: Diagnosis) -> str:
    """Per channel and sealed run; the run is told where there are several."""
    rows, several = [], len({g.run for g in d.gain}) > 1
    for g in d.gain:
        low, high = g.ci95
        _, a, b, unit = interval_and_unit(low, low, high, g.unit)
        interval, sure = f"{a} to {b} {unit}", "not significant"
        if not math.isfinite(low + high):
            interval, sure = "-", ""
        elif low > 0 or high < 0:
            sure = "better" if low > 0 else "worse"
        sure += ", worse than as delivered" if g.ci95_delivered[1] < 0.0 else ""
        sizes = [quantity(v, g.unit) for v in (g.delivered, g.recalibrated, g.extended)]
        run = [g.run] if several else []
        rows.append([*run, g.channel, *sizes, interval, sure, "yes" if g.affected else "no"])
    run, gain = ["sealed run"] if several else [], "gain over recalibrated (95 %)"
    head = [*run, "channel", "as delivered", "recalibrated", "extended", gain, "", "causes move it"]
    return table(head, rows, range(1 + several, 5 + several))


def pulls_table(d: Diagnosis) -> str:
    """Every fitted parameter: those freed of their tolerance first, then the farthest."""
    rows = [
        [p.path + (" (free of its tolerance)" if p.freed else ""), quantity(p.nominal, p.unit),
         quantity(p.value, p.unit), f"{p.pull:+.1f}", f"{p.sigma:.2f}"]
        for p in sorted(d.pulls, key=lambda p: (not p.freed, -abs(p.pull)))
    ]  # fmt: skip
    return table(["parameter", "declared", "fitted", "pull", "posterior sigma"], rows, (1, 2, 3, 4))


def families_table(d: Diagnosis) -> str:
    """Per family its statistic in these data, its threshold, and the largest of fault-free data; what comes
    nearest to its threshold, or is farthest above it, first."""
    known = dict.fromkeys([*d.observed, *d.thresholds, *d.nulls])
    rows = []
    for family in sorted(known, key=lambda f: -d.observed.get(f, 0.0) / max(d.thresholds.get(f, math.inf), 1e-9)):
        nulls = [float(v) for v in d.nulls.get(family, []) if math.isfinite(v)]
        threshold = d.thresholds.get(family, math.nan)
        row = [number(d.observed[family]) if family in d.observed else "-", number(threshold)]
        row += [number(max(nulls)), f"{sum(v > threshold for v in nulls)} of {len(nulls)}"] if nulls else ["-", "-"]
        rows.append([what(family), *row])
    head = ["family", "these data", "threshold", "largest of fault-free data", "of these above the threshold"]
    return table(head, rows, (1, 2, 3, 4))
