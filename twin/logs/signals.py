"""The load channels a model reads, taken out of a run: by column, with the dimension checked, peaks as rms."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from twin.errors import LogError, Problem
from twin.logs.run import Run
from twin.nearest import did_you_mean


class SignalLike(Protocol):
    """What of a signal's declaration matters here; `twin.rom.load_model.Signal` is one."""

    @property
    def name(self) -> str: ...
    @property
    def column(self) -> str: ...  # header in loads.csv
    @property
    def unit(self) -> str: ...  # SI
    @property
    def kind(self) -> str: ...  # "value", "rms" or "peak"
    @property
    def low(self) -> float: ...  # certified range, SI, as rms where the kind is "peak"
    @property
    def high(self) -> float: ...
    @property
    def default(self) -> float | None: ...  # SI, rms; where the whole column is missing. None: it must be there
    @property
    def factor(self) -> float: ...  # of logged values


def signal_values(run: Run, signals: Sequence[SignalLike]) -> dict[str, np.ndarray]:
    """Values (n,) of each signal at `run.loads.time`, by the signal's name; SI, temperatures degC, missing ones NaN.

    Signals with a default whose column is not there are left out: `twin.rom.drive` fills them in and flags it.
    Amplitudes of sine currents (kind "peak") are divided by sqrt(2), so that laws see rms values only.
    Raises LogError for columns that are missing or of another dimension, all at once.
    """
    problems = [p for p in signal_problems(run, signals) if not p.warning]
    if problems:
        raise LogError.collect(problems)
    columns = {s.name: column_of(run, s) for s in signals}
    return {s.name: as_meant(s, values) for s in signals if (values := columns[s.name]) is not None}


def column_of(run: Run, signal: SignalLike) -> np.ndarray | None:
    """What a run logged of a signal (n,) at `run.loads.time`, as it stands there; None where it did not.

    A temperature that is not in loads.csv is read from temperatures.csv, linearly between its rows; NaN before the
    first and after the last of them.
    """
    logged = run.loads.columns.get(signal.column)
    if logged is not None or not _measured_too(run, signal):
        return logged
    assert run.temperatures is not None
    values = run.temperatures.columns[signal.column]
    good = np.isfinite(values)
    return np.interp(run.loads.time, run.temperatures.time[good], values[good], left=np.nan, right=np.nan)


def read_from_temperatures(run: Run, signals: Sequence[SignalLike]) -> set[str]:
    """The columns of temperatures.csv that signals are read from."""
    return {s.column for s in signals if s.column not in run.loads.columns and _measured_too(run, s)}


def _measured_too(run: Run, signal: SignalLike) -> bool:
    table = run.temperatures
    if table is None or signal.unit != "degC" or signal.column not in table.columns:
        return False
    return bool(np.isfinite(table.columns[signal.column]).any())


def as_meant(signal: SignalLike, logged: np.ndarray) -> np.ndarray:
    """Logged values (n,) times the declared factor, amplitudes as rms."""
    return signal.factor * logged / (math.sqrt(2.0) if signal.kind == "peak" else 1.0)


def signal_problems(run: Run, signals: Sequence[SignalLike]) -> list[Problem]:
    """Signals without a column, a warning where they have a default, and columns of the wrong dimension."""
    where = str(run.folder / "loads.csv")
    problems = []
    for s in signals:
        found = run.loads.units.get(s.column)
        if found is None:
            if _measured_too(run, s):
                continue
            remedy = did_you_mean(s.column, run.loads.columns, "columns")
            called = "" if s.column == s.name else f" (signal '{s.name}')"
            what = f"no column '{s.column}'{called}"
            if s.default is not None:
                what += f", so its default {s.default:g} {s.unit} is taken"
            problems.append(Problem(what, where, remedy, warning=s.default is not None))
        elif found != s.unit:
            problems.append(
                Problem(
                    f"column '{s.column}' is in {found}, signal '{s.name}' in {s.unit}",
                    where,
                    "fix the unit in the header",
                )
            )
    return problems
