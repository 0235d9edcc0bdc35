"""Synthetic measurements of a machine without any hidden cause, by a model that differs from the twin in its form.

On the user's own loads: parameters drawn from their tolerances, and everything that no parameter stands for (`Form`).
What the twin's calibration leaves of them is the null distribution of every statistic: model discrepancy is learned
from some of these measurements, thresholds from the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from twin.build.places import beside
from twin.diagnose.evidence.discretisation import Difference
from twin.diagnose.model.beginning import Beginning
from twin.diagnose.model.probed_loads import convection
from twin.diagnose.model.study import Study, heated_places, own_place
from twin.diagnose.result.spot import Spot
from twin.rom.parameter import OF_LAWS

# of parameters, in prior standard deviations: all that lies within the stated tolerance is alike likely, and nothing
# beyond it (rectangular distribution; JCGM 100:2008, 4.3.7)
SPREAD = 3.0**-0.5
READ = ("source", "contact", "joint")  # kinds of parameters whose effect every channel reads in its own way


@dataclass(frozen=True)
class Form:
    """How wrong the form of a description may be; standard deviations."""

    local_film: float = 0.12  # of each face's coefficient against its group's
    shape: float = 0.05  # of a film group's coefficient, slowly varying within a run
    shape_time: float = 5400.0  # s, over which it does
    # exponents of the rise above the air that a film's coefficient may have, radiation included: 0 of forced air, 1/3
    # of turbulent free convection (Incropera, DeWitt, 6th ed. 2007, 9.6)
    exponents: tuple[float, float] = (0.0, 1.0 / 3.0)
    # of the logarithm of a film's coefficient at its top speed against that at rest: rms of the other laws of the
    # ball-screw axis and the ram borer of even seeds
    speed: float = 0.5
    speed_exponent: float = 0.15  # of that speed in the coefficient: half of 0.8 - 0.5, turbulent and laminar flow
    # of the exponent of a speed in the heat of a source: rectangular distribution between 1, friction by load, and 5/3,
    # by the lubricant (`twin.diagnose.evidence.loss_exponents`)
    loss_exponent: float = 0.19
    # of the logarithm of a contact's conductance beyond its tolerance: chosen among 0, 0.2 and 0.5 on the drawn
    # networks of even seeds 0 to 20
    contact: float = 0.2
    beside: float = 0.02  # share of a source's heat that enters another face of its part
    lump: float = 3000.0  # J/K, at the patch of a source: how far its heat reaches at once
    aside: float = 0.4  # of 8 mm, by which sensors are off
    reading: float = 0.02  # of what every source and every contact does to every channel
    air: float = 0.12  # K, fluctuation of a zone's air
    air_time: float = 1500.0  # s, its memory
    start: float = 0.10  # K, of the machine's initial temperature
    start_apart: float = 0.03  # K, of single parts on top
    offset: float = 0.05  # K, of sensors
    tcp_zero: float = 0.3e-6  # m


@dataclass(frozen=True)
class Instruments:
    """White noise of single readings."""

    temperature: float = 0.1  # K
    tcp: float = 1e-6  # m


def null(
    study: Study, J: list[np.ndarray], seed: int, instruments: Instruments, form: Form = Form(),
    differences: Sequence[Difference] = (),
) -> np.ndarray:  # fmt: skip
    """Measurements (m,) of the fitted runs without a cause; NaN where the plan has none.

    J: nominal Jacobians by run.
    """
    rng = _generator(seed)
    probed = study.probed
    x = _parameters(study, rng)
    (body,) = probed.base.bodies
    load = probed.base.load_model
    local = np.clip(form.local_film * rng.standard_normal(len(probed.places)), -0.8, 0.8)
    mean, apart = shared_by_film(study, local)
    names = [f.name for f in load.films]
    contact = np.expm1(form.contact * np.clip(rng.standard_normal(study.slots(0).contact.shape[2]), -2.0, 2.0))
    joint = np.expm1(form.contact * np.clip(rng.standard_normal(len(load.joints)), -2.0, 2.0))
    split = [_beside(study, j, rng, form) for j in range(len(load.sources))]
    E = np.zeros_like(body.A0)
    for p in heated_places(study):
        lump = lump_of(study, p, form) * float(np.clip(rng.standard_normal(), -1.8, 1.8))
        E += lump * np.outer(probed.B[p], probed.B[p])
    readings = _readings(study, J, rng, form)
    aside = form.aside * rng.standard_normal(len(probed.base.sensors))
    offset = form.offset * rng.standard_normal(len(probed.base.sensors))
    parts = []
    for i, k in enumerate(study.fitted):
        planned = study.runs[k]
        slots = study.slots(k)
        n = slots.gate.shape[0]
        run = planned.run
        least = convection(run.drive, len(load.films)).min(axis=0)
        A, M = np.zeros_like(body.A0), np.zeros(body.n)
        for p, place in enumerate(probed.places):
            if place.film:
                strength = apart[p] * least[names.index(place.film)]
                A += strength * probed.A[p]
                M += strength * probed.M[p]
        rise = run.drive.environment[:, load.surroundings] - probed.base.reference_temperature
        slow = _smooth(rng, n, len(load.films), form.shape_time / run.step)
        wobble = mean + form.shape * slow
        forcing = np.zeros((n, body.n))
        for j, vector in enumerate(split):
            if vector is not None:
                forcing += power_of(study, k, j)[:, None] * vector
        for first, end in run.unlogged:
            for j in sources_of_surfaces(study):
                lost = swing(study, k, j) * rng.standard_normal()
                forcing[first:end] += lost * body.B[:, body.sources.index(j)]
        fluctuation = _ornstein(rng, n, len(load.environments), form.air_time / 60.0) * form.air
        whole = start_of(run.begins, form)
        initial = np.zeros(body.n) if run.begins.stated else whole * rng.standard_normal() * body.one
        initial = initial + _body_starts(study, run.begins, form, rng)
        slots.A[0], slots.M[0], slots.E[0], slots.gate[:, 0], slots.rise[:, 0] = A, M, E, 1.0, rise
        slots.film[:, 0], slots.joint[:, 0], slots.contact[:, 0], slots.initial[0] = wobble, joint, contact, initial
        slots.forcing[:, 0], slots.environment[:, 0] = forcing, fluctuation
        m = planned.measured
        states = study.states(k, x, slots, (1.0,))
        T, w = study.read(k, states, x)
        own_T, own_w = planned.split(readings[i])
        T, w = T + own_T, w + own_w
        moved = m.mean_of @ (states @ (probed.displaced - body.C).T)[:, m.column]
        count = np.where(m.count > 0, m.count, 1.0)
        T = T + aside[m.column] * moved + offset[m.column]
        T = T + instruments.temperature / np.sqrt(count) * rng.standard_normal(T.shape)
        row_sigma = instruments.tcp / m.row_weight(instruments.tcp)
        w = w + row_sigma[:, None] * rng.standard_normal(w.shape) + form.tcp_zero * rng.standard_normal(3)
        w = w - w[0] if m.from_first else w
        parts.append(np.concatenate([T.ravel(), w.ravel()]))
    y = np.concatenate(parts)
    for difference in differences:
        y = y + difference.drawn(rng, x)
    return y


def drawn(study: Study, seed: int) -> np.ndarray:
    """(n,) the parameters of the measurements of a seed, in prior standard deviations."""
    return _parameters(study, _generator(seed))


def _generator(seed: int) -> np.random.Generator:
    return np.random.default_rng([seed, 17])


def _parameters(study: Study, rng: np.random.Generator) -> np.ndarray:
    of_laws = np.array([p.kind in OF_LAWS for p in study.probed.parameters], dtype=bool)
    within = rng.uniform(-1.0, 1.0, len(of_laws))
    return np.where(of_laws, np.clip(rng.standard_normal(len(of_laws)), -2.5, 2.5), within)


def _ornstein(rng: np.random.Generator, n: int, columns: int, memory: float) -> np.ndarray:
    """Unit Ornstein-Uhlenbeck noise (n, columns) with a memory of so many steps."""
    phi = float(np.exp(-1.0 / memory))
    white = rng.standard_normal((n, columns))
    return np.asarray(lfilter([np.sqrt(1 - phi**2)], [1.0, -phi], white, axis=0, zi=phi * white[:1])[0])


def _smooth(rng: np.random.Generator, n: int, columns: int, memory: float) -> np.ndarray:
    """Unit Gaussian noise (n, columns), correlated as exp(-d^2 / (2 memory^2)) over d steps: drawn at knots a quarter
    of the memory apart, straight between them (which takes a hundredth of the variance there)."""
    knots = np.linspace(0.0, n - 1.0, int(np.ceil(4.0 * n / memory)) + 2)
    R = np.exp(-0.5 * ((knots[:, None] - knots) / memory) ** 2)
    drawn = np.linalg.cholesky(R + 1e-6 * np.eye(len(knots))) @ rng.standard_normal((len(knots), columns))
    return np.stack([np.interp(np.arange(n), knots, own) for own in drawn.T], axis=1) if columns else np.zeros((n, 0))


def shared_by_film(study: Study, local: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Relative changes of the coefficients of places (n_places,): the mean over the area of each film (n_films,), and
    what is left of each place.

    The mean acts in proportion to the coefficient as motion changes it, the rest as a constant share of its least. A
    constant share of its mean over the run would take away more than there is at rest where motion makes a film strong.
    """
    probed = study.probed
    (body,) = probed.base.bodies
    names = [f.name for f in probed.base.load_model.films]
    mean, apart = np.zeros(len(names)), np.array(local)
    for f, name in enumerate(names):
        own = [p for p, place in enumerate(probed.places) if place.film == name]
        area = np.array([float(body.one @ probed.A[p] @ body.one) for p in own])
        if area.sum() > 0.0:
            mean[f] = area @ local[own] / area.sum()
        apart[own] -= mean[f]
    return mean, apart


def power_of(study: Study, k: int, source: int) -> np.ndarray:
    """(n,) W of a source in a run, at a winding of 30 degC where its law follows one."""
    drive = study.runs[k].run.drive
    if source in drive.losses.index:
        i = drive.losses.index.index(source)
        place = int(np.searchsorted(drive.losses.grid, 30.0))
        return drive.losses.value[:, i, place]
    return drive.power[:, source]


def emitted(study: Study, k: int, source: int) -> np.ndarray:
    """(n, r) W of a source in a run, where it enters."""
    (body,) = study.probed.base.bodies
    load, drive = study.probed.base.load_model, study.runs[k].run.drive
    if load.sources[source].contact:
        return np.asarray(drive.contact_heat[:, load.contact_sources.index(source)] @ body.P.T)
    return np.outer(power_of(study, k, source), body.B[:, body.sources.index(source)])


def sources_of_surfaces(study: Study) -> list[int]:
    """All but those that are heat of a contact."""
    return [j for j, source in enumerate(study.probed.base.load_model.sources) if not source.contact]


def swing(study: Study, k: int, source: int) -> float:
    """W, by which the heat of a source differs from time to time in a run: a standard deviation."""
    return float(np.std(power_of(study, k, source)))


def lump_of(study: Study, place: int, form: Form) -> float:
    """J/K by which the patch of a source may differ: half of what follows it at once, where that is less."""
    (body,) = study.probed.base.bodies
    b = study.probed.B[place]
    return float(min(form.lump, 0.5 / (b @ np.linalg.solve(body.E, b))))


def start_of(begins: Beginning, form: Form, member: str = "") -> float:
    """K by which a machine, or one of its members beside that, may begin otherwise: a standard deviation. Where a run
    does not say where it begins, as much at least as its sensors differ in what they read first."""
    if member:
        return max(form.start_apart, begins.spread(member))
    whole = max(form.start_apart, begins.apart if begins.field is None else 0.0)
    return whole if begins.stated else max(form.start, whole)


def _beside(study: Study, source: int, rng: np.random.Generator, form: Form) -> np.ndarray | None:
    """What of 1 W of a source enters elsewhere: (r,); None for contacts and machines without places beside it."""
    probed = study.probed
    (body,) = probed.base.bodies
    if probed.base.load_model.sources[source].contact:
        return None
    B, own = body.B[:, body.sources.index(source)], own_place(study, source)
    if own is None:
        return None
    near = [p for p in beside(probed.places, own) if not Spot.read(probed.places[p].name).pad]
    share = abs(form.beside * rng.standard_normal())
    if not near:
        return None
    closeness = np.array([max(float(probed.B[p] @ B), 0.0) for p in near]) + 1e-12
    chosen = int(rng.choice(len(near), p=closeness / closeness.sum()))
    return np.asarray(share * (probed.B[near[chosen]] - B))


def _body_starts(study: Study, begins: Beginning, form: Form, rng: np.random.Generator) -> np.ndarray:
    """(r,) the members by random kelvins each."""
    (body,) = study.probed.base.bodies
    if body.E_members is None:
        return np.zeros(body.n)
    weights = rng.standard_normal(len(body.members)) * [start_of(begins, form, m) for m in body.members]
    return np.asarray(np.tensordot(weights, body.E_members @ body.one, 1))


def _readings(study: Study, J: list[np.ndarray], rng: np.random.Generator, form: Form) -> list[np.ndarray]:
    """Per fitted run (size,): each channel's own error of what every source and contact does to it."""
    sources = [i for i, p in enumerate(study.probed.parameters) if p.kind in READ]
    sigma = study.scale[sources]
    names = study.probed.base.sensors
    of_sensor = form.reading * rng.standard_normal((len(names), len(sources)))
    of_tcp = form.reading * rng.standard_normal((3, len(sources)))
    result = []
    for jac, k in zip(J, study.fitted, strict=True):
        planned = study.runs[k]
        T, w = planned.split(jac[:, sources] / sigma)
        T, w = T * of_sensor[planned.measured.column], w * of_tcp
        result.append(np.concatenate([T.sum(axis=2).ravel(), w.sum(axis=2).ravel()]))
    return result
