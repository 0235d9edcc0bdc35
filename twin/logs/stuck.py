"""Channels that stop changing while their neighbours go on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.errors import Problem
from twin.logs.channels import DRIVES, MOVES, PLACES, pairs
from twin.logs.found import held, span, warning
from twin.logs.run import Table

_ROWS = 20  # a shorter standstill is not looked at
_IDLE = 0.02  # of the turning rows: a drive that reads zero more often may coast (a judgement before any result)
_EXPECTED = 25.0  # changes that its neighbours made one expect, for a standstill to be told


@dataclass(frozen=True)
class Standstill:
    """A temperature that stands still while the others change as often as before."""

    name: str
    first: int  # row of the first reading of the stretch
    last: int
    value: float  # degC
    expected: float  # changes that the others made one expect


def standstills(table: Table) -> list[Standstill]:
    """Where temperatures stand still, one stretch of each at most: the one in which most goes on elsewhere.

    Expected changes are the channel's own elsewhere, scaled by how often the others (their median) changed meanwhile:
    a coarse sensor in slow air may rest for an hour, one with noise may not. What changes is seen from one reading of
    the channel to its next: empty cells neither end a standstill nor make one.
    """
    columns = {name: held(v) for name, v in table.columns.items() if np.isfinite(v).any()}
    every = _moves(columns, np.arange(len(table.time)))
    found = []
    for name, values in columns.items():
        rows = np.flatnonzero(np.isfinite(table.columns[name]))
        moves, busy = every if len(rows) == len(values) else _moves(columns, rows)
        own = np.count_nonzero(moves[name])
        first, last = longest_rest(moves[name], busy - moves[name])
        if last - first < _ROWS or own < 10:
            continue
        others = [m for n, m in moves.items() if n != name]
        inside = np.array([np.count_nonzero(m[first:last]) for m in others], dtype=float)
        outside = np.array([np.count_nonzero(m) for m in others], dtype=float) - inside
        usable = outside >= 10
        if not usable.any():
            continue
        expected = float(own * np.median(inside[usable] / outside[usable]))
        if expected >= _EXPECTED:
            found.append(Standstill(name, int(rows[first]), int(rows[last]), float(values[rows[first]]), expected))
    return found


def frozen_throughout(tables: Sequence[Table]) -> list[tuple[int, Standstill]]:
    """Temperatures that stand still in all of a table and not in others of the same machine, with the table's number.

    As `standstills`, which tells nothing of a channel that never changed: how often it should have is taken from the
    other tables, by how often the others (their median) changed there and here.
    """
    moves = []
    for table in tables:
        columns = {n: v[np.isfinite(v)] for n, v in table.columns.items()}
        moves.append({n: int(np.count_nonzero(np.diff(v))) for n, v in columns.items() if len(v) > _ROWS})
    busy = [float(np.median(list(m.values()))) if m else 0.0 for m in moves]
    found = []
    for k, table in enumerate(tables):
        for name in (n for n, m in moves[k].items() if m == 0):
            elsewhere = [i for i, m in enumerate(moves) if m.get(name, 0) >= 10 and busy[i] > 0.0]
            own, others = sum(moves[i][name] for i in elsewhere), sum(busy[i] for i in elsewhere)
            expected = busy[k] * own / others if elsewhere else 0.0
            if expected >= _EXPECTED:
                rows = np.flatnonzero(np.isfinite(table.columns[name]))
                value = float(table.columns[name][rows[0]])
                found.append((k, Standstill(name, int(rows[0]), int(rows[-1]), value, expected)))
    return found


def stuck_loads(loads: Table, where: str) -> list[Problem]:
    """Warnings about channels of one drive that contradict each other: speed without motion, motion without speed,
    currents, torques and powers to the last digit the same while the drive turns."""
    problems: list[Problem] = []
    for speed, position in pairs(loads, MOVES, PLACES):
        v, x = held(loads.columns[speed]), held(loads.columns[position])
        turns, moves = v[:-1] != 0.0, np.diff(x) != 0.0
        both = np.count_nonzero(turns & moves)
        if both < _ROWS:
            continue  # a drive that never moved, or a spindle's angle
        first, last = longest_rest(~(turns & ~moves))
        if last - first >= _ROWS and both > 0.5 * (np.count_nonzero(turns) - (last - first)):
            what = f"'{position}' rests while '{speed}' does not"
            problems.append(warning(what, span(where, first, last), "one of the two channels is frozen"))
        first, last = longest_rest(~(moves & ~turns))
        if last - first >= _ROWS and both > 0.5 * (np.count_nonzero(moves) - (last - first)):
            what = f"'{position}' moves while '{speed}' is zero"
            problems.append(warning(what, span(where, first, last), "one of the two channels is frozen"))
    for speed, other in [*pairs(loads, ("m/s",), ("1/s",)), *pairs(loads, ("1/s",), ("m/s",))]:
        problems += _one_of_two(loads, speed, other, where)
    told: set[str] = set()
    for speed, drive in pairs(loads, MOVES, DRIVES):
        if drive not in told and (found := _frozen_drive(loads, speed, drive, where)):
            told.add(drive)
            problems.append(found)
    return problems


def longest_rest(moves: np.ndarray, meanwhile: np.ndarray | None = None) -> tuple[int, int]:
    """First and last row of the stretch without a move in which most happens; moves (n - 1,) bool between rows.

    meanwhile (n - 1,): what happens between rows, 1 by default, so that the longest stretch is taken.
    """
    edges = np.flatnonzero(np.concatenate([[True], moves, [True]]))
    happened = np.arange(len(moves) + 1) if meanwhile is None else np.concatenate([[0], np.cumsum(meanwhile)])
    last = edges[1:] - 1  # the row before the next move
    k = int(np.argmax(happened[last] - happened[edges[:-1]]))
    return int(edges[k]), int(edges[k + 1] - 1)


def _moves(columns: Mapping[str, np.ndarray], rows: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Per channel (n - 1,) bool: whether it changes from one of n rows to the next; and how many do."""
    moves = {name: np.diff(v[rows]) != 0.0 for name, v in columns.items()}
    return moves, np.sum(list(moves.values()), axis=0, dtype=int)


def _one_of_two(loads: Table, frozen: str, other: str, where: str) -> list[Problem]:
    """Two speeds of one drive: `frozen` stands still while `other` changes as it did together with it elsewhere."""
    a, b = np.diff(held(loads.columns[frozen])) != 0.0, np.diff(held(loads.columns[other])) != 0.0
    first, last = longest_rest(a, b)
    inside = int(np.count_nonzero(b[first:last]))
    outside = int(np.count_nonzero(b)) - inside
    together = int(np.count_nonzero(a & b))
    if inside < _ROWS or outside < 10 or together < 0.8 * outside or np.ptp(held(loads.columns[frozen])) == 0.0:
        return []
    what = f"'{frozen}' stands still while '{other}' changes"
    return [warning(what, span(where, first, last), "a frozen channel? leave its cells empty if so")]


def _frozen_drive(loads: Table, speed: str, drive: str, where: str) -> Problem | None:
    turns = held(loads.columns[speed])[:-1] != 0.0
    values = held(loads.columns[drive])
    moves = np.diff(values) != 0.0
    first, last = longest_rest(~(turns & ~moves))
    rows = last - first
    elsewhere = np.count_nonzero(turns) - rows
    if rows < _ROWS or (values[first] == 0.0 and _at_nought(values, turns, first, last) > _IDLE * elsewhere):
        return None
    share = np.count_nonzero(turns & moves) / elsewhere if elsewhere >= _ROWS else 0.0
    # a channel that changes from row to row with this probability does not rest so long by chance
    if share < 0.5 or rows * -np.log1p(-min(share, 0.99)) < _EXPECTED:
        return None
    what = f"'{drive}' is {values[first]:g} {loads.units[drive]} to the last digit while '{speed}' goes on"
    return warning(what, span(where, first, last), "a frozen channel? leave its cells empty if so")


def _at_nought(values: np.ndarray, turns: np.ndarray, first: int, last: int) -> int:
    """Rows outside of first .. last in which a drive turns and its channel is nought."""
    nought = turns & (values[:-1] == 0.0)
    nought[first : last + 1] = False
    return int(np.count_nonzero(nought))
