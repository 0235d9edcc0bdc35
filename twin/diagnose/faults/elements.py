"""Elementary causes: every (kind, place, history) whose first-order response the bank holds.

Kinds by what they do to the model x' = A(theta) x + B(theta) u, y = C x:

    heat     P          B_p s(t)                              1 W
    film     p          s(t) (-A_p x + M_p (T_air - T_ref))   1 W/(m^2 K) more on a surface
    group    f          s(t) h_f (-A_f x + M_f (...))         100 % more of a film's convection
    zone     f          s(t) h_f M_f                          1 K warmer air at a film
    air      e          s(t) sum_f h_f M_f                    1 K warmer air of an environment
    gradient e          sum_f h_f H_f                         1 K/m
    joint    j, contact c                                     100 % more conductance
    capacity p          -b_p b_p^T x'                         1 J/K
    source   j          s(t) B_j                              1 W of another history at a source
    warm     j          P_j(t) b_j b_j^T x                    100 % more of a source per kelvin of its own surface
    loss     j          P_j(t) B_j                            100 % more of a source, by blocks
    wear     j          P_j(t) exp(-h_j(t) / tau) B_j         100 % more of a source at first, h_j hours that it has run
    moved    j>p        P_j(t) (B_p - B_j)                    all of a source's heat elsewhere
    signal   q*f                                              a load channel times a factor
    start    m          T(0) of a member                      1 K
    unlogged i.g.j      heat of a source in a gap of loads    1 W
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.build.places import beside
from twin.diagnose.evidence.nulls import emitted, sources_of_surfaces
from twin.diagnose.evidence.speeds import SPEEDS
from twin.diagnose.model.bank import Column, Nominal
from twin.diagnose.model.probed_loads import convection, gammas
from twin.diagnose.model.study import Study, own_place
from twin.rom.drive import Drive, evaluate
from twin.rom.following import read_table, temperature_place
from twin.rom.load_model import LoadModel, Signal
from twin.run.system import System

BLOCK = 3600.0  # s
# by which a signal of a unit may be misread: peak for rms and line for phase (currents, powers), two of a kind for one,
# minutes for seconds. A speed has no peak, and a switch is on or off
MISREAD = {
    "A": (0.5, 2.0, 2.0**0.5, 0.5**0.5, 3.0**0.5, 3.0**-0.5),
    "W": (0.5, 2.0, 3.0**0.5, 3.0**-0.5),
    "m/s": (0.5, 2.0, 60.0, 1 / 60.0),
    "1/s": (0.5, 2.0, 60.0, 1 / 60.0),
}
EXPONENT = 0.6  # of speeds in forced convection
HEATING = {"A": (2.0,), "m/s": (1.0,), "1/s": (1.0, 5.0 / 3.0), "W": (1.0,), "1": (1.0,)}  # exponents by unit, of heat
# s of running of running-in of a bearing or a guide: a judgement, of what shows in runs of a day
RUNNING_IN = 7200.0, 21600.0
# of a switch: the share of steps in which it may be on for a part of the time, and that in which it must be off: a
# judgement before any result
BETWEEN, OFF = 0.1, 0.1
RUNS = 0.01  # of its largest heat: a source that emits more runs
LAWS = (1.0, 5.0 / 3.0, 2.0, 8.0 / 3.0)  # exponents of speeds in losses

Key = tuple[str, str, str]  # kind, place, history


@dataclass(frozen=True)
class Histories:
    """Named histories s(t) of order one, per run of the study (n,); the sealed ones have no blocks."""

    signals: dict[str, tuple[np.ndarray, ...]]  # "spindle_speed^1.67": of losses
    speeds: dict[str, tuple[np.ndarray, ...]]  # "x_speed^0.6": of convection
    blocks: tuple[tuple[int, int, int], ...]  # (fitted run, first step, end)
    unit: dict[str, tuple[str, float, float]]  # history -> signal, exponent, value [SI] at which s = 1
    switches: tuple[str, ...] = ()  # of the signals: on or off, as a valve


@dataclass(frozen=True)
class Elements:
    """All elementary causes of a study with what the time integration needs."""

    histories: Histories
    vectors: tuple[tuple[np.ndarray, ...], ...]  # per run of the study: (r,) or (n, r) each
    columns: tuple[Column, ...]
    index: dict[Key, int]  # of the columns
    block_of: dict[tuple[str, str], np.ndarray]  # (kind, place) -> indices of its block columns

    @property
    def heat_blocks(self) -> dict[str, np.ndarray]:
        """Place -> its block columns of heat."""
        return {place: own for (kind, place), own in self.block_of.items() if kind == "heat"}


# kinds whose vectors exact refits step; others have slots
FORCINGS = frozenset({"zone", "gradient", "signal", "loss", "wear"})


def slim(elements: Elements) -> Elements:
    """Without the vectors that nothing needs once the responses are there: a tenth of the memory."""
    needed = {elements.columns[c].vector for (kind, _, _), c in elements.index.items() if kind in FORCINGS}
    none = np.zeros((0, 0), dtype=np.float32)
    vectors = tuple(
        tuple(v if v.ndim == 1 else v.astype(np.float32) if i in needed else none for i, v in enumerate(of_run))
        for of_run in elements.vectors
    )
    return replace(elements, vectors=vectors)


def histories_of(study: Study) -> Histories:
    """Histories of the logged signals that tell how hard a drive works, and blocks of an hour."""
    load = study.probed.base.load_model
    runs = [planned.run for planned in study.runs]
    n = [run.drive.n_steps for run in runs]
    signals: dict[str, tuple[np.ndarray, ...]] = {"always": tuple(np.ones(k) for k in n)}
    speeds: dict[str, tuple[np.ndarray, ...]] = {}
    unit: dict[str, tuple[str, float, float]] = {"always": ("", 1.0, 1.0)}

    def add(table: dict[str, tuple[np.ndarray, ...]], name: str, signal: str, exponent: float, scale: float) -> None:
        table[name] = tuple(np.abs(run.signals[signal] / scale) ** exponent for run in runs)
        unit[name] = (signal, exponent, scale)

    seen, switches = list[np.ndarray](), list[str]()
    for signal in _of_drives(load):
        name = signal.name
        if any(name not in run.signals for run in runs):
            continue
        whole = np.abs(np.concatenate([run.signals[name] for run in runs]))
        top = float(whole.max())
        if top <= 1e-9 * max(abs(signal.low), abs(signal.high), 1e-30):
            continue
        shape = whole / top
        if any(np.abs(shape - other).max() < 1e-3 for other in seen):
            continue  # motor speed and axis speed are one history
        seen.append(shape)
        if signal.unit == "1" and _switches(whole):
            switches.append(name)
        for e in HEATING.get(signal.unit, ()):
            add(signals, name if e == 1.0 else f"{name}^{e:.3g}", name, e, top)
        if signal.unit in SPEEDS:
            add(speeds, f"{name}^{EXPONENT:g}", name, EXPONENT, top)
    return Histories(signals, speeds, blocks_of(study), unit, tuple(switches))


def _switches(values: np.ndarray) -> bool:
    """Whether a signal (n,) is off or on, 0 or 1, as a description has switches."""
    partly = (values > 0.0) & (np.abs(values - 1.0) > 1e-6)
    return bool(np.mean(partly) < BETWEEN and np.mean(values == 0.0) > OFF and np.any(values == 1.0))


def blocks_of(study: Study, length: float = BLOCK) -> tuple[tuple[int, int, int], ...]:
    """(fitted run, first step, end) of blocks of about so many seconds, an hour by default."""
    blocks: list[tuple[int, int, int]] = []
    for i, k in enumerate(study.fitted):
        run = study.runs[k].run
        edges = list(range(0, run.drive.n_steps, max(round(length / run.step), 1)))
        if run.drive.n_steps - edges[-1] < length / run.step / 2 and len(edges) > 1:
            edges.pop()
        blocks += [(i, a, b) for a, b in zip(edges, [*edges[1:], run.drive.n_steps], strict=True)]
    return tuple(blocks)


def _of_drives(load: LoadModel) -> list[Signal]:
    """Logged signals but positions of axes and temperatures of air."""
    others = {a.position for a in load.axes} | {e.signal for e in load.environments if e.signal}
    return [s for s in load.signals if s.name not in others]


def elements_of(study: Study, nominal: Sequence[Nominal]) -> Elements:
    """Every elementary cause of a study; nominal: of all its runs."""
    probed, load = study.probed, study.probed.base.load_model
    (body,) = probed.base.bodies
    system = probed.system
    histories = histories_of(study)
    runs = [planned.run for planned in study.runs]
    n = [run.drive.n_steps for run in runs]
    vectors: list[list[np.ndarray]] = [[] for _ in runs]
    columns: list[Column] = []
    index: dict[Key, int] = {}
    block_of: dict[tuple[str, str], np.ndarray] = {}

    def add(
        kind: str, name: str, of: Sequence[np.ndarray], acting: Mapping[str, Sequence[np.ndarray | None]],
        in_blocks: bool = False, at_start: bool = False,
    ) -> None:  # fmt: skip
        """A vector per run, as a column for each history, and for each block."""
        v = len(vectors[0])
        for own, vector in zip(vectors, of, strict=True):
            own.append(np.asarray(vector))
        for history, values in acting.items():
            index[kind, name, history] = len(columns)
            columns.append(Column(v, tuple(values), at_start))
        if not in_blocks:
            return
        block_of[kind, name] = len(columns) + np.arange(len(histories.blocks))
        for b, (i, start, end) in enumerate(histories.blocks):
            gate = np.zeros(n[i])
            gate[start:end] = 1.0
            index[kind, name, f"block {b}"] = len(columns)
            columns.append(Column(v, tuple(gate if j == i else None for j in range(len(runs)))))

    always = {"always": histories.signals["always"]}
    z = [own.middle for own in nominal]
    films = [f.name for f in load.films]
    air = [run.drive.environment - probed.base.reference_temperature for run in runs]
    film_env = [f.environment for f in load.films]
    A, M = np.asarray(system.A[0]), np.asarray(system.M)
    # heat and film at places
    for p, place in enumerate(probed.places):
        b = probed.B[p]
        add("heat", place.name, [b] * len(runs), histories.signals, True)
        e = environment_at(study, p)
        flow = [-x @ probed.A[p].T + a[:, [e]] * probed.M[p] for x, a in zip(z, air, strict=True)]
        switched = {name: histories.signals[name] for name in histories.switches}
        add("film", place.name, flow, {**always, **histories.speeds, **switched}, True)
        stored = [-np.outer(np.diff(own.states @ b, axis=0) * own.rate, b) for own in nominal]
        add("capacity", place.name, stored, always)
    for f, name in enumerate(films):
        flow = [-x @ A[f].T + own.outer[:, [f]] * M[:, f] for x, own in zip(z, nominal, strict=True)]
        add("group", name, [own.convection[:, [f]] * q for own, q in zip(nominal, flow, strict=True)], always, True)
        add("group_film", name, flow, histories.speeds)
        add("zone", name, [own.total[:, [f]] * M[:, f] for own in nominal], always, True)
    for e, environment in enumerate(load.environments):
        own_films = [f for f in range(len(films)) if film_env[f] == e]
        add("air", environment.name, [own.total[:, own_films] @ M[:, own_films].T for own in nominal], {}, True)
        lifted = probed.H[:, own_films] - pivot(study, e) * M[:, own_films]
        if np.abs(probed.H[:, own_films]).max(initial=0.0) > 0.0:
            add("gradient", environment.name, [own.convection[:, own_films] @ lifted.T for own in nominal], always)
    for kind, name in conductances(load):
        add(kind, name, [conducted(study, k, kind, name, x) for k, x in enumerate(z)], {}, True)
    powers = [_power_of(system, run.drive, own) for run, own in zip(runs, nominal, strict=True)]
    for j, source in enumerate(load.sources):
        heat = [emitted(study, k, j) for k in range(len(runs))]
        add("loss", source.name, heat, {}, True)
        for tau in RUNNING_IN:
            fresh = worn(powers, j, [run.step for run in runs], tau)
            acting = {f"running-in over {tau / 3600.0:g} h": histories.signals["always"]}
            add("wear", source.name, [q * left[:, None] for q, left in zip(heat, fresh, strict=True)], acting)
        if source.contact:
            continue
        B = body.B[:, body.sources.index(j)]
        add("source", source.name, [B] * len(runs), _law_histories(study, j, histories))
        add("warm", source.name, [q * (x @ B)[:, None] for q, x in zip(heat, z, strict=True)], always)
        own_at = own_place(study, j)
        for p in beside(probed.places, own_at) if own_at is not None else ():
            moved, own = [probed.B[p] - B] * len(runs), [q[:, j] for q in powers]
            add("moved", f"{source.name}>{probed.places[p].name}", moved, {"always": own})
    for name, factor, of in _signals(study, nominal, powers):
        add("signal", f"{name}*{factor:.6g}", of, always)
    for i in range(len(study.fitted)):
        for m, field in _fields(study):
            only_here = [np.zeros(n[i]) if j == i else None for j in range(len(runs))]
            add("start", f"{runs[i].name}.{m}", [field] * len(runs), {"always": only_here}, at_start=True)
        for g, (first, end) in enumerate(study.runs[study.fitted[i]].run.unlogged):
            gate = np.zeros(n[i])
            gate[first:end] = 1.0
            for j in sources_of_surfaces(study):
                B = body.B[:, body.sources.index(j)]
                only_here = [gate if k == i else None for k in range(len(runs))]
                add("unlogged", f"{i}.{g}.{j}", [B] * len(runs), {"always": only_here})
    return Elements(histories, tuple(tuple(v) for v in vectors), tuple(columns), index, block_of)


def environment_at(study: Study, p: int) -> int:
    """Number of the environment that the film of place p is in."""
    load, film = study.probed.base.load_model, study.probed.places[p].film
    return next((f.environment for f in load.films if f.name == film), load.surroundings)


def pivot(study: Study, e: int) -> float:
    """Height [m] at which the air of an environment is as measured: told, or the middle of its films.

    A gradient about another height is an offset as well, which calibration resists.
    """
    probed, load = study.probed, study.probed.base.load_model
    if load.environments[e].height != 0.0 or load.environments[e].gradient != 0.0:
        return float(load.environments[e].height)
    (body,) = probed.base.bodies
    own = [f for f, film in enumerate(load.films) if film.environment == e]
    area = float((body.one @ np.asarray(probed.system.M)[:, own]).sum())
    return float((body.one @ probed.H[:, own]).sum() / area) if area > 0.0 else 0.0


def conductances(load: LoadModel) -> list[tuple[str, str]]:
    """(kind, name) of all that conducts between parts."""
    return [*(("joint", j.name) for j in load.joints), *(("contact", name) for name in load.contacts)]


def conducted(study: Study, k: int, kind: str, name: str, z: np.ndarray) -> np.ndarray:
    """(n, r) of states z (n, r) in run k, at the nominal conductance: -kappa A_j z of a joint, -P Gamma_c P^T z of a
    contact."""
    probed, run = study.probed, study.runs[k].run
    load, n_films = probed.base.load_model, probed.layout.n_films
    if kind == "joint":
        at = n_films + [j.name for j in load.joints].index(name)
        return np.asarray(-np.asarray(run.drive.theta)[:, [at]] * (z @ np.asarray(probed.system.A[0])[at].T))
    P = np.asarray(probed.system.P[0])
    mask = np.array([float(c == name) for c in load.contacts])
    gamma = gammas(probed.contacts, run.loads, mask)
    return np.asarray(-np.einsum("tij,tj->ti", gamma, z @ P) @ P.T)


def _power_of(system: System, drive: Drive, nominal: Nominal) -> np.ndarray:
    """(n, n_sources) W of all sources of a run at the nominal windings."""
    power = drive.power.copy()
    if drive.losses.index:
        winding = float(system.reference_temperature) + nominal.states[:-1] @ np.asarray(system.source_rows).T
        power[:, list(drive.losses.index)] = read_table(np, drive.losses.value, temperature_place(np, winding))
    return np.asarray(power)


def worn(powers: Sequence[np.ndarray], j: int, steps: Sequence[float], tau: float) -> list[np.ndarray]:
    """Per run (n,): exp(-h / tau) of the time h [s] that source j has run before, in all runs one after the other."""
    top, before, result = max(float(q[:, j].max(initial=0.0)) for q in powers), 0.0, []
    for q, step in zip(powers, steps, strict=True):
        ran = before + step * np.cumsum(q[:, j] > RUNS * top)
        result.append(np.exp(-ran / tau))
        before = float(ran[-1])
    return result


def _law_histories(study: Study, j: int, histories: Histories) -> dict[str, tuple[np.ndarray, ...]]:
    """Other shapes of a source that reads a speed: |n| to another exponent."""
    load = study.probed.base.load_model
    runs = [planned.run for planned in study.runs]
    units = {s.name: s.unit for s in load.signals}
    result: dict[str, tuple[np.ndarray, ...]] = {}
    for signal in load.sources[j].use.signals.values():
        if units.get(signal) not in SPEEDS or any(signal not in run.signals for run in runs):
            continue
        top = max(float(np.abs(run.signals[signal]).max()) for run in runs)
        if top <= 0.0:
            continue
        for exponent in LAWS:
            name = f"{signal}^{exponent:.2f}"
            result[name] = tuple(np.abs(run.signals[signal] / top) ** exponent for run in runs)
            histories.unit[name] = (signal, exponent, top)
    return result


def _signals(
    study: Study, nominal: Sequence[Nominal], powers: Sequence[np.ndarray]
) -> list[tuple[str, float, list[np.ndarray]]]:
    """(signal, factor, per run (n, r)): what all laws that read a signal would add, were it larger by a factor."""
    probed, load = study.probed, study.probed.base.load_model
    (body,) = probed.base.bodies
    uses = [s.use for s in load.sources] + [f.use for f in load.films]
    read = {s for use in uses for s in use.signals.values()}
    A, M = np.asarray(probed.system.A[0]), np.asarray(probed.system.M)
    in_contact = list(load.contact_sources)
    B = np.zeros((body.n, len(load.sources)))
    B[:, list(body.sources)] = body.B
    B[:, in_contact] = 0.0
    result = []
    for signal in _of_drives(load):
        if signal.name not in read:
            continue
        for factor in MISREAD.get(signal.unit, ()):
            per_run, moves = [], False
            for k, (own, power) in enumerate(zip(nominal, powers, strict=True)):
                run = study.runs[k].run
                if signal.name not in run.signals or not np.any(run.signals[signal.name]):
                    per_run.append(np.zeros((run.drive.n_steps, body.n)))
                    continue
                sources, films, drive = _evaluated(study, k, signal.name, factor)
                small = replace(probed.system, source_rows=np.asarray(probed.system.source_rows)[[
                    probed.layout.following_losses.index(j) for j in sources if j in probed.layout.following_losses
                ]])  # fmt: skip
                grown_power = np.zeros_like(power)
                grown_power[:, sources] = _power_of(small, drive, own) - power[:, sources]
                ratio = grown_power / np.where(power > 0.0, power, 1.0)
                forcing = grown_power @ B.T
                forcing = forcing + np.einsum("ts,tsp->tp", ratio[:, in_contact], run.drive.contact_heat) @ body.P.T
                more = convection(drive, len(films)) - convection(run.drive, len(load.films))[:, films]
                for f, grown in zip(films, more.T, strict=True):
                    if np.any(grown):
                        flow = -own.middle @ A[f].T + own.outer[:, [f]] * M[:, f]
                        forcing = forcing + np.clip(grown, -50.0, 200.0)[:, None] * flow
                moves |= bool(np.abs(forcing).max() > 0.0)
                per_run.append(np.asarray(forcing))
            if moves:
                result.append((signal.name, factor, per_run))
    return result


def _evaluated(study: Study, k: int, signal: str, factor: float) -> tuple[list[int], list[int], Drive]:
    """Sources and films that read a signal, and a drive of these alone with the signal multiplied."""
    run, load = study.runs[k].run, study.probed.base.load_model
    sources = [j for j, s in enumerate(load.sources) if signal in s.use.signals.values()]
    films = [f for f, film in enumerate(load.films) if signal in film.use.signals.values()]
    reading = tuple(replace(load.sources[j], contact="") for j in sources)
    only = replace(load, pairs=(), joints=(), rails=(), ports=(), axes=(), sources=reading,
                   films=tuple(load.films[f] for f in films))  # fmt: skip
    signals = {name: values * (factor if name == signal else 1.0) for name, values in run.signals.items()}
    return sources, films, evaluate(only, run.drive.time[:-1], signals, run.step, run.drive.n_steps)


def _fields(study: Study) -> list[tuple[str, np.ndarray]]:
    """Initial fields: the whole machine, and each member, by 1 K."""
    (body,) = study.probed.base.bodies
    result = [("machine", np.asarray(body.one))]
    if body.E_members is not None and len(body.members) > 1:
        result += [(m, E @ body.one) for m, E in zip(body.members, body.E_members, strict=True)]
    return result
