"""What is hidden in a trial, in pieces to put together: its truth in words, what it does to machine and logs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np

from twin.build.acting import Acting
from twin.inject.experiment import STEPS
from twin.inject.hidden import Hidden
from twin.inject.truth.behaviour import Behaviour, Clean
from twin.logs.run import Run, Table
from twin.rom.drive import Drive


@dataclass(frozen=True)
class Part:
    """A hidden thing and what it does."""

    hidden: tuple[Hidden, ...]
    behaviour: Behaviour = Behaviour()
    factors: Mapping[str, float] = field(default_factory=dict)  # parameter -> factor on top of the draw's
    readings: Callable[[int, Run, Clean], Run] = lambda _run, run, _clean: run  # before noise is added
    logs: Callable[[int, Run], Run] = lambda _run, run: run  # after


def together(parts: Sequence[Part]) -> Part:
    """Several hidden things at once."""
    factors: dict[str, float] = {}
    for p in parts:
        for path, factor in p.factors.items():
            factors[path] = factors.get(path, 1.0) * factor
    return Part(
        tuple(h for p in parts for h in p.hidden),
        _behaviour([p.behaviour for p in parts]),
        factors,
        lambda r, run, clean: reduce(lambda seen, p: p.readings(r, seen, clean), parts, run),
        lambda r, run: reduce(lambda seen, p: p.logs(r, seen), parts, run),
    )


def _behaviour(several: Sequence[Behaviour]) -> Behaviour:
    """What several things do, one after the other."""
    return Behaviour(
        heats=tuple(dict.fromkeys(h for b in several for h in b.heats)),
        films=tuple(dict.fromkeys(f for b in several for f in b.films)),
        acting=lambda r, drive: _acting([b.acting(r, drive) for b in several]),
        loads=lambda r, drive: reduce(lambda felt, b: b.loads(r, felt), several, drive),
        shape=lambda model: reduce(lambda shaped, b: b.shape(shaped), several, model),
        really=lambda r, log: reduce(lambda true, b: b.really(r, true), several, log),
        laws=any(b.laws for b in several),
        warm={k: v for b in several for k, v in b.warm.items()},
        late={k: v for b in several for k, v in b.late.items()},
    )


def _acting(each: Sequence[Acting]) -> Acting:
    """Powers at one place add up."""
    power: dict[str, np.ndarray] = {}
    for a in each:
        for place, watts in a.power.items():
            power[place] = power.get(place, 0.0) + np.asarray(watts)
    return Acting(
        power, {k: v for a in each for k, v in a.film.items()}, {k: v for a in each for k, v in a.medium.items()}
    )


def heating(hidden: Hidden, watts: Sequence[np.ndarray]) -> Part:
    """Heat at the place of a hidden thing; watts: per run (STEPS,)."""
    place = hidden.place
    return Part((hidden,), Behaviour(heats=(place,), acting=lambda r, _: Acting({place: watts[r]})))


def cooling(hidden: Hidden, film: Sequence[np.ndarray], medium: int | float, place: str = "") -> Part:
    """A film [W/(m^2 K)] at a place, per run (STEPS,), to an environment (its index) or to a constant temperature."""
    at = place or hidden.place

    def acting(r: int, drive: Drive) -> Acting:
        outside = drive.environment[:, medium] if isinstance(medium, int) else np.full(STEPS, medium)
        return Acting(film={at: film[r]}, medium={at: outside})

    return Part((hidden,), Behaviour(films=(at,), acting=acting))


def more_film(drive: Drive, film: int, by: np.ndarray) -> Drive:
    """The drive with more convection (STEPS,) [W/(m^2 K)] of a film of the description."""
    if film in drive.films.index:
        value = drive.films.value.copy()
        value[:, drive.films.index.index(film)] += by[:, None]
        return replace(drive, films=replace(drive.films, value=value))
    theta = drive.theta.copy()
    theta[:, film] += by
    return replace(drive, theta=theta)


def with_tcp(run: Run, more: np.ndarray) -> Run:
    """The run with displacements (m, 3) [m] on top."""
    assert run.tcp is not None
    return replace(run, tcp=replace(run.tcp, displacement=run.tcp.displacement + more))


def with_sensor(run: Run, name: str, values: np.ndarray) -> Run:
    """The run with other readings of a sensor (n,) [degC]."""
    assert run.temperatures is not None
    table = run.temperatures
    return replace(run, temperatures=Table(table.time, {**table.columns, name: values}, table.units))


def with_column(run: Run, name: str, values: np.ndarray) -> Run:
    """The run with another column of loads."""
    return replace(run, loads=Table(run.loads.time, {**run.loads.columns, name: values}, run.loads.units))
