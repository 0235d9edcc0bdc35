"""The plan of the next experiment in words, for a terminal and the page of a diagnosis."""

from __future__ import annotations

from html import escape

from twin.diagnose.report.tables import folded, table
from twin.diagnose.report.text import place_words, times, what
from twin.diagnose.result.numbers import number, quantity
from twin.diagnose.result.plan import Apart, Foresight, Plan, Proposal

FEW = 2  # suspicions of which a terminal gets all experiments; of more the best one each
ROWS = 8  # experiments that a terminal gets of one
WORTH = 1.05  # times smaller a limit must become, for an experiment to be proposed


def plan_lines(plan: Plan) -> list[str]:
    """Lines for a terminal, sorted by gain."""
    lines = []
    for apart in plan.pairs:
        lines.append(f"To separate {apart.first} from {apart.second}: {_separation(apart)}")
        lines += [f"  {number(s.expected):>8}  {s.experiment}: {s.words}" for s in apart.separations[:ROWS]]
    few = len(plan.suspicions) <= FEW
    for f in plan.suspicions:
        lines.append(f"Next experiment for {f.family} {f.place}: {_today(f)}")
        lines += [_line(f, p) for p in f.proposals[: ROWS if few else 1]]
    return lines


def plan_section(plan: Plan | None) -> str:
    """HTML of the section, empty without a plan."""
    if plan is None:
        return ""
    parts = []
    for apart in plan.pairs:
        told = [[s.experiment, s.words, number(s.expected)] for s in apart.separations]
        lead = f"To separate {apart.first} from {apart.second}: {_separation(apart)}"
        parts.append(f"<p>{escape(lead)}</p>" + table(["experiment", "what to do", "separation then"], told, (2,)))
    if plan.suspicions:
        best = [
            [what(f.family), place_words(f.place), seen(f, f.today), p.experiment, seen(f, p.limit), gained(p)]
            for f in plan.suspicions for p in f.proposals[:1]
        ]  # fmt: skip
        head = ["what", "where", "seen today", "best experiment", "seen then", "times smaller"]
        parts.append(table(head, best, (2, 4, 5)))
    for f in plan.suspicions:
        rows = [[p.experiment, p.words, seen(f, p.limit), gained(p)] for p in f.proposals]
        own = table(["experiment", "what to do", "seen then", "times smaller"], rows, (2, 3))
        parts.append(folded(f"All experiments for {what(f.family)} at {place_words(f.place)}: {_today(f)}", own))
    taken = "; ".join(plan.assumptions)
    return "\n".join([*parts, f"<p>{escape(f'This takes: {taken}.')}</p>"])


def _line(f: Foresight, p: Proposal) -> str:
    return f"  {gained(p):>8}  {seen(f, p.limit)}, {p.experiment}: {p.words}"


def _today(f: Foresight) -> str:
    text = f"today seen {seen(f, f.today)}, with the longest run again {seen(f, f.again)}"
    worth = f.proposals and f.proposals[0].gain > WORTH
    return text if worth else f"{text}; no experiment lowers that much"


def _separation(apart: Apart) -> str:
    return f"{number(apart.needed)} is needed, these data give {number(apart.today)}"


def gained(p: Proposal) -> str:
    return f"{number(p.gain)} x"


def seen(f: Foresight, limit: float) -> str:
    """From which size on, or that none within physics is seen."""
    if f.largest is not None and limit > f.largest:
        return f"not up to {_size(f, f.largest)}"
    return f"from {_size(f, limit)}"


def _size(f: Foresight, size: float) -> str:
    unit = times(f.family, f.unit)
    return f"{quantity(size, f.unit)} {unit}".rstrip()
