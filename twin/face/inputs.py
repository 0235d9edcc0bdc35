"""What the functions of the face accept: numbers or strings with a unit, run folders or runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import TwinError
from twin.units import to_si

if TYPE_CHECKING:
    from twin.logs.run import Run

Quantity = float | str  # a number in SI (temperatures in degC), or a string with a unit: "60 s", "1 um"


def quantity(name: str, value: Quantity, unit: str) -> float:
    """The value in SI; a string of digits counts as a number. Raises TwinError naming the argument."""
    try:
        try:
            return to_si(float(value), unit)
        except ValueError:
            return to_si(value, unit)
    except ValueError as e:
        raise TwinError(
            str(e), name, f"write a number with a unit of {unit}, for example {_written(name, unit)}"
        ) from e


def positive(name: str, value: Quantity, unit: str, zero: bool = False) -> float:
    """The same above zero, or from zero on. Raises TwinError naming the argument."""
    number = quantity(name, value, unit)
    if not math.isfinite(number) or number < 0.0 or (number == 0.0 and not zero):
        wanted = "zero or a positive value" if zero else "a positive value"
        raise TwinError(f"{value} is out of range", name, f"give {wanted}, for example {_written(name, unit)}")
    return number


def _written(name: str, unit: str) -> str:
    return f"{name}{' ' if name.startswith('-') else '='}'1 {unit}'"


def run_of(run: Run | str | Path) -> Run:
    """A run as it is, or read from its folder. Raises LogError as `twin.logs.read.read_run`."""
    from twin.logs.read import read_run

    return read_run(Path(run)) if isinstance(run, str | Path) else run


def runs_of(runs: Sequence[Run | str | Path] | Run | str | Path) -> list[Run]:
    """All runs of a sequence; one run counts as a sequence of one."""
    return [run_of(run) for run in listed(runs)]


def listed(runs: Sequence[Run | str | Path] | Run | str | Path) -> list[Run | str | Path]:
    """The sequence as a list; one run is a list of one."""
    return list(runs) if isinstance(runs, list | tuple) else [runs]  # type: ignore[list-item]


def name_of(run: Run | str | Path) -> str:
    """The folder of a run as it was given."""
    return str(run) if isinstance(run, str | Path) else str(run.folder)
