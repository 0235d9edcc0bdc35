"""What is to be hidden, as it is asked for with units, and what that means in SI for a machine or for a log."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from twin.errors import TwinError
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import Kind
from twin.logs.refuse import usual_step
from twin.logs.run import Run
from twin.machine.description import Machine
from twin.machine.effects.effect import Effect, Window
from twin.nearest import did_you_mean
from twin.units import parse_unit, to_si

PROFILE = 12  # windows that draw the half sine of the sun
UNITS: dict[str, tuple[str, ...]] = {  # of the size, by family; the first that fits
    "film_gain": ("1", "W/(m^2*K)"), "forced_convection": ("W/(m^2*K)",), "heat_source": ("W",),
    "loss_law": ("1", "W"), "joint": ("1",), "zone": ("K", "K/m"), "sun": ("W",), "coolant": ("W/(m^2*K)",),
    "scale_expansion": ("1/K",), "expansion": ("1",), "capacity": ("J/K", "1"), "misplaced_source": (),
    "missing_joint": ("W/K",),
}  # fmt: skip
SETTINGS: dict[str, dict[str, str | None]] = {  # by family: name and unit; "": that of the signal, None: a name
    "heat_source": {"reference": ""}, "loss_law": {"reference": "", "gain": "1"}, "zone": {"height": "m"},
    "coolant": {"temperature": "degC"}, "capacity": {"conductance": "W/K"},
    "scale_expansion": {"fixed_at": "m", "surface": None, "axis": None},
}  # fmt: skip
FOLLOWING = ("forced_convection", "heat_source", "loss_law", "sun")  # a power of their signal
STEADY = ("expansion", "scale_expansion", "capacity", "misplaced_source", "missing_joint")


@dataclass(frozen=True)
class When:
    """When something hidden acts, and how: always, with a signal, or between two times."""

    kind: str = ""  # of a fault of a log: "offset", "drift", "lag", ...; "" for the first of its family
    signal: str = ""  # logged signal that it follows
    exponent: float = 1.0  # of that signal
    start: float | None = None  # s since the start of the run
    end: float | None = None


@dataclass(frozen=True)
class Request:
    """What is to be hidden, as it was asked for."""

    family: str
    place: str
    size: str  # with a unit: "10 W", "3"; a place where one is exchanged for another
    when: When = When()
    settings: Mapping[str, str] = field(default_factory=dict)  # with units


def effect_of(asked: Request, machine: Machine, logs: Sequence[Run]) -> Effect:
    """What is to be hidden in a machine, as `twin.machine.effects.edits` takes it.

    Raises TwinError for units of another dimension, unknown settings and signals, and times outside the runs.
    """
    when = asked.when
    if when.kind:
        remedy = "use --signal with --exponent, or --from and --to"
        raise TwinError(f"'{asked.family}' has no kinds to choose from", "--history", remedy)
    if when.signal and (asked.family in STEADY or (asked.family, asked.place[:6]) == ("film_gain", "films.")):
        raise TwinError(f"'{asked.family}' acts always", "--signal", "leave it out")
    windows = _windows(asked, logs)
    amplitude, unit = 0.0, ""
    settings: dict[str, float | str] = {n: _setting(n, text, asked, machine) for n, text in asked.settings.items()}
    if asked.family == "misplaced_source":
        settings["surface"] = asked.size
    else:
        amplitude, unit = _amplitude(asked)
    history = "always"
    if when.signal:
        history = when.signal + (f"^{when.exponent:g}" if when.exponent != 1.0 else "")
    elif windows:
        history = _told_windows(when)
    return Effect(
        asked.family, asked.place, amplitude, unit, history, when.signal, when.exponent, windows, settings
    )  # fmt: skip


def damage_of(asked: Request, kind: Kind, run: Run) -> Damage:
    """What is to be hidden in a log. Raises TwinError as `effect_of` does."""
    when = asked.when
    if asked.settings:
        raise TwinError("is for machines", "--setting", f"a fault of a log has a size only, which {kind.meaning}")
    if when.signal and not kind.follows:
        raise TwinError(f"'{asked.family}' of this kind follows no column", "--signal", "leave it out")
    damage = Damage(
        family=asked.family,
        place=asked.place,
        size=_size(asked.size, kind.unit) if kind.unit else math.nan,
        history=when.kind,
        signal=when.signal,
        other="" if kind.unit else asked.size,
        start=-math.inf if when.start is None else when.start,
        end=math.inf if when.end is None else when.end,
    )
    if kind.unit == "s" and not damage.size > 0.0:
        raise TwinError(f"a time of {asked.size}", "SIZE", "give a positive one, for example '10 min'")
    _expect_some(damage.start, damage.end, run)
    return damage


def _amplitude(asked: Request) -> tuple[float, str]:
    """The size in SI, in the first unit of the family that it can have."""
    units = UNITS[asked.family]
    if asked.family == "film_gain":
        units = units[:1] if asked.place.startswith("films.") else units[1:]
    if asked.family == "loss_law":
        units = units[1:] if asked.when.signal else units[:1]
    problems = []
    for unit in units:
        try:
            return _size(asked.size, unit), unit
        except TwinError as e:
            problems.append(e)
    raise problems[0]


def _size(text: str, unit: str) -> float:
    try:
        return to_si(text, unit)
    except ValueError as e:
        example = "'3'" if unit == "1" else f"'10 {unit}'"
        raise TwinError(str(e), "SIZE", f"write a number{'' if unit == '1' else ' with its unit'}: {example}") from e


def _setting(name: str, text: str, asked: Request, machine: Machine) -> float | str:
    known = SETTINGS.get(asked.family, {})
    if name not in known:
        remedy = did_you_mean(name, known, f"settings of '{asked.family}'")
        raise TwinError(f"'{asked.family}' has no setting '{name}'", "--setting", remedy)
    unit = known[name]
    if unit is None:
        return text
    if name == "reference":  # of the signal
        if asked.when.signal not in machine.signals:
            remedy = did_you_mean(asked.when.signal, machine.signals, "signals")
            raise TwinError(f"unknown signal '{asked.when.signal}'", "--signal", remedy)
        unit = parse_unit(machine.signals[asked.when.signal].unit).si
    try:
        return to_si(text, unit)
    except ValueError as e:
        raise TwinError(str(e), f"--setting {name}", f"write a number with its unit: '1 {unit}'") from e


def _windows(asked: Request, logs: Sequence[Run]) -> tuple[Window, ...]:
    """From --from to --to in every run; of the sun a half sine between them. None where neither is given."""
    if asked.when.start is None and asked.when.end is None:
        return ()
    if asked.when.signal:
        raise TwinError("a history is given by a signal or by times", "--signal", "leave out --from and --to")
    found = []
    runs: list[Run | None] = [*logs] if logs else [None]
    for log in runs:
        start = asked.when.start or 0.0
        end = _span(log)[1] if asked.when.end is None else asked.when.end
        _expect_some(start, end, log)
        name = "" if log is None else log.folder.resolve().name
        if asked.family != "sun":
            found.append(Window(name, start, end))
            continue
        if end == math.inf:
            raise TwinError("needs the time at which the sun is gone", "--to", "give --from and --to")
        step = (end - start) / PROFILE
        found += [
            Window(name, start + k * step, start + (k + 1) * step, math.sin(math.pi * (k + 0.5) / PROFILE))
            for k in range(PROFILE)
        ]
    return tuple(found)


def _span(log: Run | None) -> tuple[float, float]:
    """Start and end [s] of a run: its last row is held as long as the others. Without an end where none is given."""
    if log is None:
        return 0.0, math.inf
    return float(log.loads.time[0]), float(log.loads.time[-1] + usual_step(log.loads))


def _expect_some(start: float, end: float, log: Run | None) -> None:
    """Raise TwinError where nothing of a run lies between two times [s]."""
    first, last = _span(log)
    if not max(start, first) < min(end, last):
        within = "" if log is None else f" within the run, {first / 3600.0:g} h .. {last / 3600.0:g} h"
        raise TwinError("nothing is left between --from and --to", "--from", f"give times{within}, --from before --to")


def _told_windows(when: When) -> str:
    start = f"from {(when.start or 0.0) / 3600.0:g} h"
    return start + (" on" if when.end is None else f" to {when.end / 3600.0:g} h")
