"""A machine or a log with something in it that its description does not know: a truth for experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import TwinError
from twin.face.inputs import Quantity, quantity
from twin.face.machine import Machine, load

if TYPE_CHECKING:
    from twin.logs.run import Run


@dataclass(frozen=True)
class HideOptions:
    """When something hidden acts, and how: by default always."""

    history: str = ""  # kind of a fault of a log: "offset", "drift", "lag", ...
    signal: str = ""  # logged signal that it follows
    exponent: float = 1.0  # of that signal
    start: Quantity | None = None  # time at which it begins
    end: Quantity | None = None
    settings: Mapping[str, str] = field(default_factory=dict)  # what a family needs besides, with units


def hide(
    target: Machine | Run | str | Path,
    family: str,
    place: str,
    size: str,
    output: str | Path,
    options: HideOptions | None = None,
    runs: Sequence[str | Path] = (),
) -> Machine | Run:
    """Inject a fault of `size` ("10 W") at `place` in a copy of a machine, or of a run folder, written to `output`.

    family: one of `twin diagnose` (docs/hiding.md). runs: run folders that get the switch of a hidden history.
    Returns the copy; of a machine it is a truth for `twin.simulate`.
    Raises TwinError for unknown families, places and signals, and units of another dimension.

    >>> import twin
    >>> truth = twin.hide("tests/machines/spindle", "heat_source", "housing", "40 W", "out/hidden")
    >>> truth.parameters["sources.hidden_1.gain"]
    1.0
    """
    from twin.logs.read import read_run

    told(target, family, place, size, output, options, runs)
    folder = Path(output)
    return load(folder) if (folder / "machine.toml").exists() else read_run(folder)


def told(
    target: Machine | Run | str | Path,
    family: str,
    place: str,
    size: str,
    output: str | Path,
    options: HideOptions | None = None,
    runs: Sequence[str | Path] = (),
) -> list[str]:
    """The same; returns what was done, in words."""
    from twin.inject.hide import hide as write
    from twin.inject.request import When

    o = options or HideOptions()
    names = [Path(run).resolve().name for run in runs]
    if twice := sorted({n for n in names if names.count(n) > 1}):
        raise TwinError(f"two runs are called '{twice[0]}'", "--run", "rename a folder: copies keep these names")
    start, end = (None if t is None else quantity(n, t, "s") for n, t in (("start", o.start), ("end", o.end)))
    when = When(o.history, o.signal, o.exponent, start, end)
    return write(_folder(target), family, place, size, output, when, o.settings, runs)


def _folder(target: Machine | Run | str | Path) -> Path:
    """Where a machine or a run lies."""
    if isinstance(target, Machine):
        return target.unchanged()
    return Path(target) if isinstance(target, str | Path) else target.folder
