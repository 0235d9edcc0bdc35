"""The plan of the next experiment in words, for a terminal and the page of a diagnosis."""

from __future__ import annotations

from twin.diagnose.faults.table import what
from twin.diagnose.report.tables import folded, items, table
from twin.diagnose.report.text import place_words, sized
from twin.diagnose.result.numbers import number
from twin.diagnose.result.plan import Apart, Foresight, Plan

FEW = 2  # suspicions of which a terminal gets all experiments; of more the best one each
ROWS = 8  # experiments that a terminal gets of one
WORTH = 1.05  # times smaller a limit must become, for an experiment to be proposed


def plan_lines(plan: Plan) -> list[str]:
    """Lines for a terminal, sorted by gain."""
    lines = []
    for apart in plan.pairs:
        lines.append(_separation(apart))
        lines += [f"  {number(s.expected):>8}  {s.experiment}: {s.words}" for s in apart.separations[:ROWS]]
    shown = ROWS if len(plan.suspicions) <= FEW else 1
    for f in plan.suspicions:
        lines.append(f"Next experiment for {f.family} {f.place}: {_today(f)}")
        lines += [f"  {gain:>8}  {seen}, {name}: {words}" for gain, seen, name, words in _experiments(f)[:shown]]
    return lines


def plan_section(plan: Plan | None) -> str:
    """HTML of the section, empty without a plan: per pair and suspicion a line with the best, its table folded."""
    if plan is None:
        return ""
    parts = []
    for apart in plan.pairs:
        told = [[number(s.expected), s.experiment, s.words] for s in apart.separations]
        parts.append(folded(_separation(apart), table(["separation then", "experiment", "what to do"], told, (0,))))
    for f in plan.suspicions:
        rows = _experiments(f)
        lead = f"{what(f.family)} at {place_words(f.place)}: {_today(f)}"
        best = f"; best: {rows[0][2]}, {rows[0][1]} ({rows[0][0]})" if rows and _worth(f) else ""
        head = ["times smaller", "detection limit then", "experiment", "what to do"]
        parts.append(folded(lead + best, table(head, rows, (0, 1))))
    return "\n".join([*parts, folded("Assumptions", items(plan.assumptions))])


def _experiments(f: Foresight) -> list[list[str]]:
    """Gain, what is seen then, name and what to do, the best first."""
    return [[f"{number(p.gain)} x", _seen(f, p.limit), p.experiment, p.words] for p in f.proposals]


def _worth(f: Foresight) -> bool:
    return bool(f.proposals) and f.proposals[0].gain > WORTH


def _today(f: Foresight) -> str:
    text = f"detection limit {_seen(f, f.today)} today, {_seen(f, f.again)} with the longest run again"
    return text if _worth(f) else f"{text}; no experiment lowers that much"


def _separation(apart: Apart) -> str:
    needed, today = number(apart.needed), number(apart.today)
    return f"To separate {apart.first} from {apart.second}: {needed} is needed, these data have {today}"


def _seen(f: Foresight, limit: float) -> str:
    """The limit, or that it lies beyond all sizes within physics."""
    if f.largest is not None and limit > f.largest:
        return f"above {sized(f.family, f.largest, f.unit)}"
    return sized(f.family, limit, f.unit)
