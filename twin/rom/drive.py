"""A load log turned into what the thermal model is driven by, step by step.

Losses and films are evaluated at every load sample and then averaged over each step: powers are averaged, never
currents or speeds before a nonlinear law (paper 001, erratum E-001-4: 20 % duty at 10 A is a factor 5). Scalar loads
hold until the next sample, positions run linearly to it; all means are exact for that reading of the log, whatever
the step, so energy is neither lost nor gained.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from twin.errors import LogError
from twin.physics.laws import LAWS
from twin.rom.check_laws import check_laws
from twin.rom.contact import dwell, dwell_by_segment, segment_borders
from twin.rom.following import Following
from twin.rom.law_values import law_values, laws_hold, states_of
from twin.rom.load_model import Joint, LawUse, LoadModel, Pair
from twin.rom.sampling import Intervals, cut, path_points
from twin.rom.tabulate import following_films, following_losses


@dataclass(frozen=True)
class Drive:
    """Per step of length dt (n steps); everything the same for the full model, the reduced model and calibration."""

    time: np.ndarray  # (n + 1,) s, step edges
    power: np.ndarray  # (n, n_sources) W, gains included, surfaces and contacts alike; 0 where `losses` tells
    contact_heat: np.ndarray  # (n, n_contact_sources, n_ports) W that each brings into each port, following the pads
    theta: np.ndarray  # (n, n_theta) W/(m^2 K): convection of films, gains included, 0 where `films` tells; then joints
    films: Following  # films whose law follows the surface temperature
    losses: Following  # sources whose law follows the temperature of their surface
    environment: np.ndarray  # (n, n_environments) degC, offsets included: what the machine feels, not what is measured
    conductance: np.ndarray  # (n, n_pairs) W/K, means over the steps where contacts are switched
    weight: np.ndarray  # (n, n_pairs, n_segments) dwell mean of w, zero-padded to the longest rail
    square: np.ndarray  # (n, n_pairs, n_segments) dwell mean of w_i^2
    neighbour: np.ndarray  # (n, n_pairs, n_segments) dwell mean of w_i w_{i+1}; last column zero
    position: np.ndarray  # (n, n_axes) m at the end of each step
    mean_position: np.ndarray  # (n, n_axes) m over each step
    flags: np.ndarray  # (n, n_flags) bool: flag_names[k] holds at some time in this step
    flag_names: tuple[str, ...]  # e.g. "signals.x_current above 20 A", "gap in loads"
    switched: np.ndarray | None = None  # (n, n_environments) K of `environment` that switches bring; None: no switch
    angle: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # (n, n_rotary) rad at the end of each step
    radiation: bool = True  # False where `theta` is the whole coefficient of films (scenarios at the box's bounds)

    @property
    def n_steps(self) -> int:
        return len(self.time) - 1

    @property
    def port_heat(self) -> np.ndarray:
        """(n, n_ports) W that all contact sources bring into each port."""
        return self.contact_heat.sum(axis=1)


def split(drive: Drive, times: int) -> Drive:
    """The drive in steps so many times as short, each with the loads of the step that it lies in."""
    if times == 1:
        return drive
    share = np.arange(1, times + 1) / times
    edges = drive.time[:-1, None] + np.diff(drive.time)[:, None] * share

    def repeated(value: Any) -> Any:
        if isinstance(value, Following):
            return replace(value, value=value.value.repeat(times, axis=0), outside=value.outside.repeat(times, axis=0))
        return value.repeat(times, axis=0) if isinstance(value, np.ndarray) else value

    changed: dict[str, Any] = {f.name: repeated(getattr(drive, f.name)) for f in fields(drive)}
    return replace(drive, **changed | {"time": np.concatenate([drive.time[:1], edges.ravel()])})


def evaluate(
    load_model: LoadModel,
    time: np.ndarray,
    signals: Mapping[str, np.ndarray],
    dt: float,
    n_steps: int | None = None,
) -> Drive:
    """Evaluate laws, contacts and environments of a load log over steps of `dt` [s] from its first sample on.

    time (m,) [s] strictly increasing; signals: (m,) each, SI (temperatures degC); NaN means "no value": the last value
    is held and the step flagged. Without `n_steps` the steps reach the last sample (at least one step). A contact
    source is shared equally by the pairs of its contact, `rail_share` of it by the segments under the moving pad, each
    by the heat made while the pad dwells there.

    Raises LogError for missing or empty signals and for times that do not increase, DescriptionError for laws that
    cannot be evaluated.
    """
    if n_steps is None:
        n_steps = max(1, int(np.ceil((time[-1] - time[0]) / dt - 1e-9))) if len(time) else 1
    return evaluate_between(load_model, time, signals, dt * np.arange(n_steps + 1), dt)


def evaluate_between(
    load_model: LoadModel, time: np.ndarray, signals: Mapping[str, np.ndarray], edges: np.ndarray, dt: float
) -> Drive:
    """The same between edges (n_steps + 1,) [s since the first sample], of pieces of steps of `dt` [s]."""
    check_laws(load_model)
    time, values, missing, absent = _clean(load_model, time, signals)
    n_steps = len(edges) - 1
    t = time - time[0]  # small numbers: seconds since 1970 would cost seven digits
    intervals = cut(t, edges)

    powers, powers_hold = _read_from_log([(s.use, s.gain) for s in load_model.sources], values, len(t))
    films, films_hold = _read_from_log([(f.use, f.gain) for f in load_model.films], values, len(t))
    joints = np.array([j.conductance for j in load_model.joints])
    pairs = np.array([p.conductance * p.area for p in load_model.pairs])
    environments = _columns(
        [(values[e.signal] if e.signal else np.full(len(t), e.temperature)) + e.offset
         for e in load_model.environments], len(t)
    )  # fmt: skip
    switched = None
    if any(e.switch for e in load_model.environments):
        switched = _columns(
            [e.switched_offset * (values[e.switch] if e.switch else np.zeros(len(t)))
             for e in load_model.environments], len(t)
        )  # fmt: skip
        environments = environments + switched

    path = {a.name: np.interp(np.append(intervals.start, intervals.end[-1]), t, values[a.position])
            for a in load_model.axes}  # fmt: skip
    flags = _flags(load_model, t, values, missing, path, intervals, dt)
    flags |= _defaults(load_model, absent, n_steps)
    flags |= _outside("sources", [(s.name, s.use) for s in load_model.sources], powers_hold, intervals)
    flags |= _outside("films", [(f.name, f.use) for f in load_model.films], films_hold, intervals)
    weight, square, neighbour, contact_heat = _contacts(load_model, path, powers, intervals)
    return Drive(
        time=time[0] + edges,
        power=intervals.mean(powers),
        contact_heat=contact_heat,
        theta=np.hstack([intervals.mean(films), joints * _switched(load_model.joints, values, intervals)]),
        films=following_films(load_model, values, environments, intervals),
        losses=following_losses(load_model, values, intervals),
        environment=intervals.mean(environments),
        conductance=pairs * _switched(load_model.pairs, values, intervals),
        weight=weight,
        square=square,
        neighbour=neighbour,
        position=_columns([np.interp(edges[1:], t, values[a.position]) for a in load_model.axes], n_steps),
        mean_position=_columns([intervals.mean_of_path(path[a.name]) for a in load_model.axes], n_steps),
        angle=_columns([np.interp(edges[1:], t, values[a.position]) for a in load_model.rotary], n_steps),
        flags=np.stack(list(flags.values()), axis=1),
        flag_names=tuple(flags),
        switched=None if switched is None else intervals.mean(switched),
    )


def measured_air(load_model: LoadModel, drive: Drive) -> np.ndarray:
    """What sensors in the air show (n, n_environments) [degC]: the environments without offsets, switched or not."""
    shown = drive.environment - np.array([e.offset for e in load_model.environments])
    return shown if drive.switched is None else shown - drive.switched


def outside_flag(kind: str, name: str, text: str) -> str:
    """The name of the flag of a law outside its validity, of "sources" or "films"."""
    return f"{kind}.{name}: law outside {text}"


def _outside(
    kind: str, uses: list[tuple[str, LawUse]], hold: np.ndarray, intervals: Intervals
) -> dict[str, np.ndarray]:
    """Flags of laws that read the log alone; those that follow a state are judged after the run."""
    return {
        outside_flag(kind, name, validity.text): intervals.any(~hold[intervals.sample, k])
        for k, (name, use) in enumerate(uses)
        if (validity := LAWS[use.law].validity) and not states_of(use)
    }


def _read_from_log(
    uses: list[tuple[LawUse, float]], values: dict[str, np.ndarray], n: int
) -> tuple[np.ndarray, np.ndarray]:
    """Laws with gains that read the log alone (n, len(uses)), zero where a law follows a state; and where they hold."""
    fixed = [k for k, (use, _) in enumerate(uses) if not states_of(use)]
    result, hold = np.zeros((n, len(uses))), np.ones((n, len(uses)), dtype=bool)
    gains = np.array([uses[k][1] for k in fixed])
    result[:, fixed] = gains * law_values([uses[k][0] for k in fixed], values, n)
    published = [k for k in fixed if LAWS[uses[k][0].law].validity]
    hold[:, published] = laws_hold([uses[k][0] for k in published], values, n)
    return result, hold


def _switched(
    contacts: Sequence[Joint] | Sequence[Pair], values: dict[str, np.ndarray], intervals: Intervals
) -> np.ndarray:
    """Means over steps (n_steps, len(contacts)) of the factors that switches give to conductances.

    Above zero whatever is logged: values outside 0 .. 1 are clipped here, and flagged as outside the signal's range.
    """
    factor = np.ones((intervals.n_steps, len(contacts)))
    for k in range(len(contacts)):
        contact: Joint | Pair = contacts[k]
        if contact.switch:
            factor[:, k] += (contact.switched - 1.0) * intervals.mean(np.clip(values[contact.switch], 0.0, 1.0))
    return factor


def _columns(columns: list[np.ndarray], n: int) -> np.ndarray:
    """(n, len(columns)); also of no columns."""
    return np.stack(columns, axis=1) if columns else np.zeros((n, 0))


def _clean(
    load_model: LoadModel, time: np.ndarray, signals: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray], list[str]]:
    """Time, signals without gaps, where values were missing, and the signals that are at their defaults."""
    time = np.asarray(time, dtype=float)
    if time.ndim != 1 or len(time) == 0 or not np.all(np.diff(time) > 0.0) or not np.all(np.isfinite(time)):
        raise LogError("times do not increase strictly", "loads", "run `twin check` on the run folder")
    needed = needed_signals(load_model)
    defaults = {s.name: s.default for s in load_model.signals if s.default is not None and s.name not in signals}
    absent = sorted(name for name in needed if name not in signals and name not in defaults)
    if absent:
        raise LogError(f"missing signals: {', '.join(absent)}", "loads", "log them, or run `twin check` to see columns")
    values, missing = {name: np.full(len(time), value) for name, value in defaults.items()}, {}
    for name in sorted((needed - set(defaults)) | {s.name for s in load_model.signals if s.name in signals}):
        filled, lost = _filled(name, np.asarray(signals[name], dtype=float), time)
        if filled is not None:
            values[name], missing[name] = filled, lost
        elif name in needed:
            raise LogError("no valid value at all", f"loads: {name}", "check the sensor or the column's unit")
    return time, values, missing, sorted(needed & set(defaults))


def needed_signals(load_model: LoadModel) -> set[str]:
    """Signals that laws, positions, environments and switches read."""
    uses = [source.use for source in load_model.sources] + [film.use for film in load_model.films]
    needed = {name for use in uses for name in use.signals.values()}
    needed |= {a.position for a in load_model.axes} | {a.position for a in load_model.rotary}
    needed |= {e.signal for e in load_model.environments if e.signal}
    needed |= {c.switch for c in load_model.joints + load_model.pairs if c.switch}
    return needed | {e.switch for e in load_model.environments if e.switch}


def _filled(name: str, raw: np.ndarray, time: np.ndarray) -> tuple[np.ndarray | None, np.ndarray]:
    """A signal with each gap at the value before it, the first at the one after, and where; None without any value."""
    if raw.shape != time.shape:
        raise LogError(f"{raw.size} values for {time.size} times", f"loads: {name}", "give one value per time")
    lost = ~np.isfinite(raw)
    if lost.all():
        return None, lost
    last = np.maximum.accumulate(np.where(lost, -1, np.arange(len(raw))))
    return raw[np.where(last < 0, np.argmin(lost), last)], lost


def _pad_coordinate(pair: Pair, position: np.ndarray) -> np.ndarray:
    """Coordinate of the pad on its rail at axis positions [m]."""
    return pair.station - position if pair.rail_moves else pair.station + position


def _contacts(
    load_model: LoadModel, path: dict[str, np.ndarray], powers: np.ndarray, intervals: Intervals
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Dwell means (n_steps, n_pairs, n_segments) of w, w^2, w_i w_{i+1}; heat [W] as `Drive.contact_heat`."""
    n_steps = intervals.n_steps
    longest = max((len(rail.stations) for rail in load_model.rails), default=0)
    weight, square, neighbour = np.zeros((3, n_steps, len(load_model.pairs), longest))
    moving = load_model.contact_sources
    contact_heat = np.zeros((n_steps, len(moving), len(load_model.ports)))
    in_contact = {s.contact: sum(p.contact == s.contact for p in load_model.pairs) for s in load_model.sources}
    for k, pair in enumerate(load_model.pairs):
        rail = load_model.rails[pair.rail]
        stations, n = np.asarray(rail.stations), len(rail.stations)
        coordinate = _pad_coordinate(pair, path[load_model.axes[pair.axis].name])
        rest = intervals.constant(coordinate[:-1], coordinate[1:])
        use = ~rest[intervals.step]
        use[intervals.first] = True  # a pad at rest needs one interval, whose share is the whole step
        by_segment = pair.assignment == "segment"
        assign = dwell_by_segment if by_segment else dwell
        cuts = segment_borders(stations) if by_segment else stations
        points = path_points(cuts, coordinate[:-1][use], coordinate[1:][use])
        step, sample = intervals.step[use][points.interval], intervals.sample[use][points.interval]
        share = points.share * np.where(rest[step], 1.0, intervals.share[use][points.interval])
        means = assign(stations, points.s, step, share, n_steps)
        weight[:, k, :n], square[:, k, :n], neighbour[:, k, : n - 1] = means.mean, means.square, means.neighbour
        for i, j in enumerate(moving):
            source = load_model.sources[j]
            if source.contact != pair.contact:
                continue
            power = powers[:, j] / in_contact[source.contact]
            mean = intervals.mean(power)
            here = np.where(rest[step], mean[step], power[sample])
            under_pad = assign(stations, points.s, step, share * here, n_steps)
            contact_heat[:, i, rail.first_port : rail.first_port + n] += source.rail_share * under_pad.mean
            contact_heat[:, i, pair.pad_port] += (1.0 - source.rail_share) * mean
    return weight, square, neighbour, contact_heat


def _defaults(load_model: LoadModel, absent: list[str], n_steps: int) -> dict[str, np.ndarray]:
    """One flag per signal that the log has no column of, in the first step alone: nothing is wrong with the others."""
    first = np.arange(n_steps) == 0
    default = {s.name: f"{s.default:g} {s.unit}" for s in load_model.signals if s.default is not None}
    return {f"signals.{name} not logged, default {default[name]} taken": first for name in absent}


def _margin(low: float, high: float) -> float:
    """Values at a bound stay inside in spite of rounding."""
    return 1e-9 * max((abs(v) for v in (low, high) if np.isfinite(v)), default=0.0)


def _flags(
    load_model: LoadModel,
    t: np.ndarray,
    values: dict[str, np.ndarray],
    missing: dict[str, np.ndarray],
    path: dict[str, np.ndarray],
    intervals: Intervals,
    dt: float,
) -> dict[str, np.ndarray]:
    """Name -> (n_steps,) bool for everything outside what the model was certified for."""
    flags: dict[str, np.ndarray] = {}

    def bounds(name: str, unit: str, samples: np.ndarray, low: float, high: float) -> None:
        margin = _margin(low, high)
        flags[f"{name} below {low:g} {unit}"] = intervals.any((samples < low - margin)[intervals.sample])
        flags[f"{name} above {high:g} {unit}"] = intervals.any((samples > high + margin)[intervals.sample])

    def beyond(name: str, coordinate: np.ndarray, low: float, high: float) -> None:
        outside = (coordinate < low - _margin(low, high)) | (coordinate > high + _margin(low, high))
        flags[name] = intervals.any(outside[:-1] | outside[1:])  # paths are straight: their ends are their extremes

    for signal in load_model.signals:
        if signal.name in values:
            bounds(f"signals.{signal.name}", signal.unit, values[signal.name], signal.low, signal.high)
    for name, lost in missing.items():
        flags[f"signals.{name} missing, last value held"] = intervals.any(lost[intervals.sample])
    for axis in load_model.axes:
        beyond(f"axes.{axis.name} beyond its stroke", path[axis.name], axis.low, axis.high)
    for pair in load_model.pairs:
        stations = load_model.rails[pair.rail].stations
        coordinate = _pad_coordinate(pair, path[load_model.axes[pair.axis].name])
        name = f"contacts.{pair.contact}: {load_model.ports[pair.pad_port]} beyond the stations of its rail"
        beyond(name, coordinate, stations[0], stations[-1])
    spacing = np.diff(t)
    gap = (spacing > 5.0 * np.median(spacing)) & (spacing > dt) if len(spacing) else np.zeros(0, bool)
    flags["gap in loads"] = intervals.any(np.append(gap, False)[intervals.sample])
    flags["after the end of loads, last values held"] = intervals.any(intervals.start >= t[-1] + (1.0 - 1e-9) * dt)
    return flags
