"""Peaks declared as rms, and the reverse: a factor 2 in every copper loss."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from twin.errors import Problem
from twin.logs.channels import pairs
from twin.logs.found import at, held, times, warning
from twin.logs.run import Run
from twin.logs.signals import SignalLike

_PEAK = re.compile(r"(?:^|[^a-z])(peak|ampl\w*|amp|crest|spitze\w*|scheitel\w*|iq)(?:[^a-z]|$)", re.IGNORECASE)
_RMS = re.compile(r"(?:^|[^a-z])(rms|eff|effective|effektiv\w*)(?:[^a-z]|$)", re.IGNORECASE)
_ROOT = float(np.sqrt(2.0))
_LEAST = 30


def current_problems(run: Run, signals: Sequence[SignalLike]) -> list[Problem]:
    """Warnings where names, signs, limits or a second channel contradict the declared kind of a current.

    Evidence, no proof: a single current in its range tells nothing of its kind.
    """
    where = str(run.folder / "loads.csv")
    problems = []
    for s in signals:
        if s.unit != "A" or s.kind not in ("rms", "peak") or run.loads.units.get(s.column) != "A":
            continue
        values = run.loads.columns[s.column]
        good = values[np.isfinite(values)]
        problems += _name(s, where)
        if len(good) < _LEAST:
            continue
        below = np.flatnonzero(np.nan_to_num(values) < -1e-3 * np.abs(good).max())
        if s.kind == "rms" and len(below) and s.low >= 0.0:
            what = f"'{s.column}' is declared as rms and negative {times(len(below))}"
            remedy = 'an rms value has no sign: is it the torque-producing current Iq? Its amplitude is kind = "peak"'
            problems.append(warning(what, at(where, below), remedy))
        problems += _limit(s, np.abs(s.factor * good), where)
    return problems + _twice(run, where)


def _name(s: SignalLike, where: str) -> list[Problem]:
    says = "peak" if _PEAK.search(s.column) else "rms" if _RMS.search(s.column) else s.kind
    if says == s.kind or (_PEAK.search(s.column) and _RMS.search(s.column)):
        return []
    what = f"'{s.column}' is called {says} and declared as {s.kind}"
    return [warning(what, where, f'ask the control\'s manual; kind = "{says}" in the description if the name is right')]


def _limit(s: SignalLike, sizes: np.ndarray, where: str) -> list[Problem]:
    """A current that rests at its limit tells which limit: the rms one, or sqrt 2 times that."""
    top = float(sizes.max())
    resting = np.count_nonzero(sizes > 0.995 * top)
    if not s.high > 0.0 or resting < 5:
        return []
    ratio = top / s.high
    if s.kind == "rms" and abs(ratio / _ROOT - 1.0) < 0.01:
        what = f"'{s.column}' rests at {top:.4g} A, sqrt 2 times the {s.high:g} A that it is certified for as rms"
        return [warning(what, where, 'are these peaks? declare kind = "peak" if so')]
    if s.kind == "peak" and abs(ratio - 1.0) < 0.005:
        what = f"'{s.column}' rests at {top:.4g} A, its limit as rms, and is declared as peak"
        return [warning(what, where, 'are these rms values? declare kind = "rms" if so')]
    return []


def _twice(run: Run, where: str) -> list[Problem]:
    """Two currents of one drive a factor sqrt 2 apart."""
    problems = []
    for a, b in pairs(run.loads, ("A",), ("A",)):
        x, y = np.abs(held(run.loads.columns[a])), np.abs(held(run.loads.columns[b]))
        size = float(np.sqrt(x @ x) * np.sqrt(y @ y))
        if np.count_nonzero(y) < _LEAST or not 0.0 < size < np.inf or float(x @ y) < 0.9999 * size:
            continue
        ratio = float(x @ y) / float(y @ y)
        if abs(ratio / _ROOT - 1.0) < 0.005:
            what = f"'{a}' is sqrt 2 times '{b}' in every row: the one is the peak of the other"
            remedy = f"declare kind = \"peak\" for '{a}' and \"rms\" for '{b}'"
            problems.append(warning(what, where, remedy))
    return problems
