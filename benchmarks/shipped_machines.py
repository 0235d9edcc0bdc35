"""Faults hidden in shipped machines of parts, and what is said: `python -m benchmarks.shipped_machines NAME FIRST N`.

NAME: a shipped machine of parts. Loads are drawn once per machine, so that one detector serves all seeds; a seed draws
the values of the real machine (`twin.inject.machines.other`, castings on another mesh; its reduced rich model,
`benchmarks.shipped_truth`), and what is hidden in it. Places are drawn among those where, as the description has it,
the fault moves a sensor or the TCP by VISIBLE. Rows go to out/shipped/NAME_SEED.jsonl, and what is there is not made
again. `NAME certify` compares that model with the full one.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.drawn_machines import IN_LOG, IN_MACHINE, SHARE, detector_of, moved, places, power_of, said, told
from benchmarks.rows import VISIBLE, Row, of_seeds
from benchmarks.shipped_truth import Reduced, reduced
from twin.build.remesh import remesh
from twin.build.simulate import simulate_run
from twin.diagnose.model.study import Study
from twin.diagnose.search.detector import Detector
from twin.inject.hide import hide
from twin.inject.machines.drawn import RUNS
from twin.inject.machines.loads import loads_of_run
from twin.inject.machines.other import OFF, other
from twin.inject.request import When
from twin.logs.read import read_run
from twin.logs.run import Run, Table
from twin.logs.write import write_run
from twin.machine.description import Machine
from twin.machine.edit import edited
from twin.machine.load import load_machine
from twin.rom.parameter import Parameter

MODELS = Path(__file__).parents[1] / "models"
OUT = Path("out/shipped")
HOURS, SAMPLING, TCP_EVERY = 8.0, 60.0, 1200.0  # h and s, of each run; s between TCP rows
NOISE = 0.1, 1e-6  # K, m
SIZES = {"ram_borer": 0.21}  # m, of the real castings' mesh: that of the description has 0.26
TOGETHER = {  # signals of one motion that their names do not tell
    "ram_borer": {"spindle_speed": "spindle", "spindle_power": "spindle"},
    "ball_screw_axis": {"screw_speed": "x"},
    "transfer_unit": {"spindle_speed": "spindle", "spindle_power": "spindle", "table_torque": "table",
                      "table_motor_speed": "table"},
}  # fmt: skip
LESS = {"ram_borer": {"spindle_power": 0.45}}  # of a drawn signal: few machines cut at full power for hours
FACTORS = {"loss_law": 1.6, "joint": 0.3, "film_gain": 2.0, "expansion": 1.15}
PARAMETERS = {"loss_law": "gain", "joint": "conductance", "film_gain": "gain", "expansion": "expansion"}
TIMES = 2.0  # of what is just visible: hidden heat
TRIED = 6  # parts of which one is to move the TCP
NULLS = 2  # draws of noise with nothing hidden


@dataclass(frozen=True)
class Shipped:
    """A shipped machine and the folder in which its loads lie."""

    name: str

    @cached_property
    def machine(self) -> Machine:
        return load_machine(MODELS / self.name)

    @cached_property
    def loads(self) -> tuple[Run, ...]:
        """Loads alone, in the order of RUNS."""
        with TemporaryDirectory() as folder:
            for k, name in enumerate(RUNS):
                drawn = loads_of_run(self.machine, 500 + k, name, HOURS, SAMPLING, TOGETHER.get(self.name, {}))
                drawn.write(Path(folder) / name)
            return tuple(_less(read_run(Path(folder) / name), LESS.get(self.name, {})) for name in RUNS)

    def real(self, structure: int, values: Mapping[str, float] = {}) -> Machine:
        """A real machine with the described values, or others: other meshes, laws of films, places of sensors."""
        source = MODELS / self.name
        text = other((source / "machine.toml").read_text("utf-8"), structure, source, {})
        machine = load_machine(source / "machine.toml", edited(text, values))
        return remesh(machine, SIZES[self.name]) if self.name in SIZES else machine

    def reduced(self, seed: int) -> Reduced:
        """The real machine of a seed, of one of two structures: what is chosen on one is judged on the other."""
        return reduced(self.real(seed % 2), self.loads, TCP_EVERY)


def _less(run: Run, shares: Mapping[str, float]) -> Run:
    """A run with some of its loads scaled."""
    columns = {k: shares.get(k, 1.0) * v for k, v in run.loads.columns.items()}
    return replace(run, loads=replace(run.loads, columns=columns))


def noisy(runs: Sequence[Run], seed: int, logged: Sequence[Run]) -> list[Run]:
    """Measurements of clean runs; logged: what the control wrote of the loads."""
    rng, made = np.random.default_rng([seed, 5]), []
    for run, log in zip(runs, logged, strict=True):
        assert run.temperatures is not None
        assert run.tcp is not None
        T, w = run.temperatures, run.tcp
        columns = {k: v + NOISE[0] * rng.standard_normal(len(v)) for k, v in T.columns.items()}
        shown = w.displacement + NOISE[1] * rng.standard_normal(w.displacement.shape)
        tcp = replace(w, displacement=shown, sigma=np.full(len(shown), NOISE[1]))
        made.append(replace(run, loads=log.loads, temperatures=Table(T.time, columns, T.units), tcp=tcp))
    return made


def trials(shipped: Shipped, study: Study, seed: int) -> Iterator[tuple[str, str, str]]:
    """(family or kind, place, size) of what is hidden, at a place where it is visible; of an expansion TRIED places."""
    rng = np.random.default_rng([seed, 77])
    known = {p.path: p for p in study.probed.parameters}
    flat = np.zeros(len(known))
    nominal = [study.outputs(k, flat) for k in range(len(study.runs))]
    power = power_of(study)
    for family, names in places(shipped.machine).items():
        order = [names[i] for i in rng.permutation(len(names))]
        if family == "heat_source":
            known_places = {p.name for p in study.probed.places}  # a film's surface of no area is none
            for place in (name for name in order if name in known_places):
                size = TIMES / _visible_heat(study, nominal, place)
                if size < SHARE * power:
                    yield family, place, f"{size:.3g} W"
                    break
        elif family == "expansion":
            yield family, " ".join(order[:TRIED]), f"{FACTORS[family]:g}"
        elif family in IN_MACHINE:
            for place in order:
                p = known.get(f"{place}.{PARAMETERS[family]}")
                if p is not None and _visible(study, nominal, p, FACTORS[family]) > 1.0:
                    yield family, place, f"{FACTORS[family]:g}"
                    break
        elif order:
            yield family, order[0], order[-1] if family == "swapped" else IN_LOG[family]


def _visible(study: Study, nominal: Sequence[np.ndarray], p: Parameter, factor: float) -> float:
    """How many times VISIBLE a parameter changes what is measured."""
    x = np.zeros(len(study.probed.parameters))
    x[study.probed.parameters.index(p)] = np.log(factor) / p.sigma
    return max(_times(study, k, study.outputs(k, x) - y) for k, y in enumerate(nominal))


def _visible_heat(study: Study, nominal: Sequence[np.ndarray], place: str) -> float:
    """The same of 1 W at a place."""
    at = next(i for i, p in enumerate(study.probed.places) if p.name == place)
    x, found = np.zeros(len(study.probed.parameters)), 0.0
    for k, y in enumerate(nominal):
        slots = study.slots(k)
        forcing = np.array(slots.forcing)
        forcing[:, 0] = study.probed.B[at]
        found = max(found, _times(study, k, study.outputs(k, x, replace(slots, forcing=forcing), (1.0,)) - y))
    return found


def _times(study: Study, k: int, change: np.ndarray) -> float:
    T, w = study.runs[k].split(change)
    return max(float(np.abs(T).max()) / VISIBLE[0], float(np.abs(w).max()) / VISIBLE[1])


def values_of(known: Sequence[Parameter], seed: int) -> dict[str, float]:
    """The real machine's own [SI], by path: as described, times a draw."""
    rng = np.random.default_rng([seed, 3])
    own = [p for p in known if p.kind in OFF and not p.path.startswith("parts.")]
    return {p.path: p.nominal * (1.0 + rng.uniform(-OFF[p.kind], OFF[p.kind])) for p in own}


def measured_runs(
    shipped: Shipped, detector: Detector, seed: int, scratch: Path
) -> Iterator[tuple[tuple[str, str, str], list[Run], tuple[float, float]]]:
    """What was hidden, the measured runs, and how far it moves a sensor [K] and the TCP [m]."""
    loads, real = shipped.loads, shipped.reduced(seed)
    values = values_of(real.parameters, seed)
    clean = real.measured(loads, values, {}, TCP_EVERY)
    for k in range(NULLS):
        yield ("nothing", "", str(k)), noisy(clean, 100 * seed + k, loads), (np.inf, np.inf)
    for i, hidden in enumerate(trials(shipped, detector.study, seed), start=10):
        kind, place, size = hidden
        noise = 100 * seed + i
        if kind == "heat_source":
            faulty = real.measured(loads, values, {place: float(size.split()[0])}, TCP_EVERY)
            yield hidden, noisy(faulty, noise, loads), moved(faulty, clean)
        elif kind in IN_MACHINE:
            for at in place.split():
                path = f"{at}.{PARAMETERS[kind]}"
                changed = values | {path: values.get(path, 1.0) * float(size)}
                faulty = real.measured(loads, changed, {}, TCP_EVERY)
                by = moved(faulty, clean)
                if max(np.divide(by, VISIBLE)) > 1.0:
                    break
            yield (kind, at, size), noisy(faulty, noise, loads), by
        elif kind == "factor":  # the log says a factor too much: the machine had less
            factor = f"{1.0 / float(size):.12g}"
            had = [_hidden(run, "signal", place, factor, scratch / f"{i}_{n}") for n, run in enumerate(loads)]
            less = real.measured(had, values, {}, TCP_EVERY)
            yield hidden, noisy(less, noise, loads), moved(less, clean)
        else:
            shown = noisy(clean, noise, loads)
            wrong = [_hidden(r, "sensor", place, size, scratch / f"{i}_{n}", kind) for n, r in enumerate(shown)]
            yield hidden, wrong, (np.inf, np.inf)


def _hidden(run: Run, family: str, place: str, size: str, folder: Path, kind: str = "") -> Run:
    """A run with a fault in its log."""
    write_run(folder / "as_it_was" / run.folder.name, run)
    hide(folder / "as_it_was" / run.folder.name, family, place, size, folder / run.folder.name, When(kind))
    return read_run(folder / run.folder.name)


def _columns(run: Run) -> tuple[Mapping[str, np.ndarray], Mapping[str, np.ndarray]]:
    """Temperatures [degC] and TCP components [m] by name."""
    assert run.temperatures is not None
    assert run.tcp is not None
    return run.temperatures.columns, dict(zip("xyz", run.tcp.displacement.T, strict=True))


def certify(name: str) -> None:
    """The reduced real machines beside the full ones in the first run: the largest differences."""
    shipped = Shipped(name)
    for structure in range(2):
        real = shipped.reduced(structure)
        values = values_of(real.parameters, structure)
        (small,) = real.measured(shipped.loads[:1], values, {}, TCP_EVERY)
        full = simulate_run(shipped.real(structure, values), shipped.loads[0], tcp_every=TCP_EVERY)[0]
        (T, w), (T_full, w_full) = _columns(small), _columns(full)
        kelvin = {n: float(np.abs(v - T_full[n]).max()) for n, v in T.items()}
        metres = max(float(np.abs(v - w_full[n]).max()) for n, v in w.items())
        worst = max(kelvin, key=lambda n: kelvin[n])
        print(f"   structure {structure}: {1e3 * kelvin[worst]:.1f} mK ({worst}), {1e6 * metres:.3f} um", flush=True)


@cache
def _ready(name: str) -> tuple[Shipped, Detector]:
    shipped = Shipped(name)
    runs = noisy(shipped.reduced(0).measured(shipped.loads, {}, {}, TCP_EVERY), 0, shipped.loads)
    return shipped, detector_of(shipped.machine, runs, NOISE)


def judged(name: str, seed: int) -> list[Row]:
    """A row per trial of one real machine."""
    shipped, detector = _ready(name)
    rows: list[Row] = []
    with TemporaryDirectory() as scratch:
        for hidden, runs, by in measured_runs(shipped, detector, seed, Path(scratch)):
            rows.append(said(detector, hidden, runs) | {"moved": by})
            print(seed, hidden, rows[-1]["verdict"], rows[-1]["causes"], rows[-1]["moved"], file=sys.stderr, flush=True)
    return rows


def main(name: str, first: int, count: int) -> None:
    told(of_seeds(OUT, name, range(first, first + count), partial(judged, name)))


if __name__ == "__main__":
    if sys.argv[2:] == ["certify"]:
        certify(sys.argv[1])
    else:
        main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
