"""What is hidden in a trial, in pieces to put together: its truth in words, what it does to machine and logs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from benchmarks.five_axis import FOLDER
from benchmarks.hidden_fast import Clean, Effects, runs
from tests.hidden.load import RUNS
from twin.build.acting import Acting
from twin.diagnose.diagnosis import Window
from twin.logs.run import Run, Table
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.rom.drive import Drive
from twin.rom.model import MachineModel

STEPS = 720  # of 60 s in a run
STEP = 60.0  # s
HOUR = 3600.0
ROOM, ENCLOSURE = 0, 1  # environments
OUTER = {
    "bed.left": ROOM, "bed.right": ROOM, "bed.back": ROOM, "bed.front": ROOM, "bed.shoulder": ROOM, "bed.x_top": ROOM,
    "bed.z_top": ROOM, "bed.stem_left": ROOM, "bed.stem_right": ROOM, "column.left": ROOM, "column.right": ROOM,
    "column.front": ROOM, "column.top": ROOM, "column.back": ROOM, "headstock.back": ENCLOSURE,
    "headstock.left": ENCLOSURE, "headstock.right": ENCLOSURE, "headstock.top": ENCLOSURE, "headstock.front": ENCLOSURE,
    "carriage.left": ENCLOSURE, "carriage.right": ENCLOSURE, "carriage.front": ENCLOSURE, "carriage.back": ENCLOSURE,
    "carriage.top": ENCLOSURE, "swivel.face": ENCLOSURE, "swivel.left": ENCLOSURE, "swivel.right": ENCLOSURE,
    "swivel.back": ENCLOSURE, "table.top": ENCLOSURE, "table.back": ENCLOSURE,
}  # fmt: skip
LARGE = ("bed.z_top", "bed.x_top", "bed.stem_left", "bed.stem_right", "bed.back", "column.left", "column.right",
         "column.back", "column.front", "headstock.back", "headstock.front", "swivel.back", "table.top")  # fmt: skip
SPEEDS = {"column": "x_speed", "headstock": "y_speed", "carriage": "z_speed", "swivel": "z_speed", "table": "z_speed"}


@dataclass(frozen=True)
class Hidden:
    """One thing that the twin does not know, in the words of a diagnosis (`twin.diagnose.diagnosis.Cause`)."""

    family: str
    place: str
    history: str  # in words
    size: float  # as Cause.amplitude of the family (`twin.machine.effects.edits`); of readings SI
    unit: str
    windows: tuple[Window, ...] = ()  # none: always
    signal: str = ""
    exponent: float = 1.0
    settings: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Part:
    """A hidden thing and what it does."""

    hidden: tuple[Hidden, ...]
    effects: Effects = Effects()
    factors: Mapping[str, float] = field(default_factory=dict)  # parameter -> factor on top of the draw's
    readings: Callable[[int, Run, Clean], Run] = lambda _run, run, _clean: run  # before noise is added
    logs: Callable[[int, Run], Run] = lambda _run, run: run  # after


def together(parts: Sequence[Part]) -> Part:
    """Several hidden things at once."""

    def acting(r: int, drive: Drive) -> Acting:
        each = [p.effects.acting(r, drive) for p in parts]
        power: dict[str, np.ndarray] = {}
        for a in each:
            for place, watts in a.power.items():
                power[place] = power.get(place, 0.0) + np.asarray(watts)
        return Acting(
            power, {k: v for a in each for k, v in a.film.items()}, {k: v for a in each for k, v in a.medium.items()}
        )

    def loads(r: int, drive: Drive) -> Drive:
        for p in parts:
            drive = p.effects.loads(r, drive)
        return drive

    def shape(model: MachineModel) -> MachineModel:
        for p in parts:
            model = p.effects.shape(model)
        return model

    def really(r: int, log: Run) -> Run:
        for p in parts:
            log = p.effects.really(r, log)
        return log

    def readings(r: int, run: Run, clean: Clean) -> Run:
        for p in parts:
            run = p.readings(r, run, clean)
        return run

    def logs(r: int, run: Run) -> Run:
        for p in parts:
            run = p.logs(r, run)
        return run

    factors: dict[str, float] = {}
    for p in parts:
        for path, factor in p.factors.items():
            factors[path] = factors.get(path, 1.0) * factor
    effects = Effects(
        heats=tuple(dict.fromkeys(h for p in parts for h in p.effects.heats)),
        films=tuple(dict.fromkeys(f for p in parts for f in p.effects.films)),
        acting=acting, loads=loads, shape=shape, really=really, laws=any(p.effects.laws for p in parts),
        warm={k: v for p in parts for k, v in p.effects.warm.items()},
        late={k: v for p in parts for k, v in p.effects.late.items()},
    )  # fmt: skip
    hidden = tuple(h for p in parts for h in p.hidden)
    return Part(hidden, effects, factors, readings, logs)


def heating(hidden: Hidden, watts: Sequence[np.ndarray]) -> Part:
    """Heat at the place of a hidden thing; watts: per run (STEPS,)."""
    place = hidden.place
    return Part((hidden,), Effects(heats=(place,), acting=lambda r, _: Acting({place: watts[r]})))


def cooling(hidden: Hidden, film: Sequence[np.ndarray], medium: int | float, place: str = "") -> Part:
    """A film [W/(m^2 K)] at a place, per run (STEPS,), to an environment (its index) or to a constant temperature."""
    at = place or hidden.place

    def acting(r: int, drive: Drive) -> Acting:
        outside = drive.environment[:, medium] if isinstance(medium, int) else np.full(STEPS, medium)
        return Acting(film={at: film[r]}, medium={at: outside})

    return Part((hidden,), Effects(films=(at,), acting=acting))


def more_film(drive: Drive, film: int, by: np.ndarray) -> Drive:
    """The drive with more convection (STEPS,) [W/(m^2 K)] of a film of the description."""
    if film in drive.films.index:
        value = drive.films.value.copy()
        value[:, drive.films.index.index(film)] += by[:, None]
        return replace(drive, films=replace(drive.films, value=value))
    theta = drive.theta.copy()
    theta[:, film] += by
    return replace(drive, theta=theta)


def gate(windows: Sequence[Window], run: str) -> np.ndarray:
    """(STEPS,) the levels of the windows of a run, by its name."""
    edges = STEP * np.arange(STEPS + 1)
    level = np.zeros(STEPS)
    for w in windows:
        if w.run == run:
            level += w.level * np.clip(np.minimum(edges[1:], w.end) - np.maximum(edges[:-1], w.start), 0.0, STEP) / STEP
    return level


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


@cache
def described() -> Machine:
    """The machine as the twin knows it."""
    return load_machine(FOLDER / "machine.toml")


def one_of(rng: np.random.Generator, names: Iterable[str]) -> str:
    known = list(names)
    return known[rng.integers(len(known))]


def signal(r: int, name: str) -> np.ndarray:
    """|signal| (STEPS,) [SI] of a run, as logged."""
    return np.abs(runs()[r].loads.columns[name][:STEPS])


def windows_of(rng: np.random.Generator, hours: float, fitted: int | None = None) -> tuple[Window, ...]:
    """A window of some hours in one fitted run and one in the sealed run, on whole steps inside of them."""
    first = int(rng.integers(2)) if fitted is None else fitted
    found = []
    for r in (first, 2):
        start = STEP * round(rng.uniform(0.5 * HOUR, 11.5 * HOUR - hours * HOUR) / STEP)
        found.append(Window(RUNS[r], start, start + hours * HOUR))
    return tuple(found)


def on(windows: tuple[Window, ...]) -> list[np.ndarray]:
    return [gate(windows, run) for run in RUNS]


def followed(name: str, exponent: float) -> tuple[list[np.ndarray], float, float]:
    """A history per run, its reference [SI] (the largest value while fitting), and its mean there while it works."""
    top = max(float(signal(r, name).max()) for r in (0, 1))
    histories = [(signal(r, name) / top) ** exponent for r in range(3)]
    fitted = np.concatenate(histories[:2])
    return histories, top, float(fitted[fitted > 0.01].mean())
