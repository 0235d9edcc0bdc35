"""An effect written into a description: what `twin diagnose` proposes, and what `twin hide` hides.

Per family one function, in the table EDITS. What `Effect.amplitude` means there:

| family | place | amplitude |
|---|---|---|
| film_gain | films.X | factor of its gain |
| film_gain | part.surface | W/(m^2 K) of an additional film, always or where switched |
| forced_convection | part.surface | W/(m^2 K) at 1 m/s of `signal`, with `exponent` |
| heat_source | part.surface, contacts.X (its pads) | W: always, in windows, or at settings["reference"] of `signal` |
| loss_law | sources.X | factor of its gain; with `signal` W at settings["reference"], its gain times settings["gain"] |
| joint | contacts.X | factor of its conductance, always or where a window or a switch is on |
| zone | environment.X | K of an offset, always or where switched; K/m of a gradient |
| sun | part.surface | W at the top of the profile that the windows or `signal` draw |
| coolant | part.surface | W/(m^2 K) to settings["temperature"] degC, always or where switched |
| signal | signals.X | factor that the logged values want |
| scale_expansion | axes.X, part.surface | 1/K; settings: surface or axis, fixed_at |
| expansion | materials.X, parts.X, bars.X, tcp.expansion.NODE | factor |
| capacity | part.surface | J/K behind settings["conductance"] W/K |
| capacity | NODE, tanks.X, materials.X | factor of its own, of unit "1" |
| misplaced_source | sources.X | none: settings["surface"] |
| missing_joint | NODE<>NODE | W/K between them |

Without settings["reference"] that is the largest size in the certified range of the signal. Other families change
nothing in a description. All SI; the names of new entries are found_1, found_2, ...
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from pydantic import ValidationError

from twin.errors import DescriptionError
from twin.logs.run import Run
from twin.machine.description import Machine
from twin.machine.effects import exchange, heat, scales
from twin.machine.effects.effect import Effect, Window
from twin.machine.effects.site import Change, Site
from twin.machine.extend import appended, changed, free_name
from twin.machine.references import reference_problems
from twin.nearest import did_you_mean

_SIZES = {
    "sources": "gain", "films": "gain", "scales": "expansion", "tanks": "capacity", "materials": "expansion",
    "contacts": "total",
}  # fmt: skip


@dataclass(frozen=True)
class Edit:
    """A description with effects in it, and the histories that its new signals need."""

    text: str
    signals: Mapping[str, tuple[Window, ...]] = field(default_factory=dict)  # column of loads.csv, 0 .. 1
    parameters: tuple[str, ...] = ()  # per effect the dotted path of what it amounts to; "" where nothing changes


def extended_description(text: str, effects: Sequence[Effect], prefix: str = "found") -> Edit:
    """The text of a machine.toml with effects in it; `twin.machine.extend.removed` takes them out again.

    prefix: "found" or "hidden"; new entries are called prefix_1, prefix_2, ..., where these names are free.
    Raises DescriptionError for places that the machine does not have, and for what the description refuses.
    """
    signals: dict[str, tuple[Window, ...]] = {}
    parameters: list[str] = []
    for effect in effects:
        if effect.family not in EDITS:
            raise DescriptionError(
                f"unknown family '{effect.family}'", "", did_you_mean(effect.family, EDITS, "families")
            )
        site = Site(_described(text), tomllib.loads(text), free_name(text, prefix))
        change = EDITS[effect.family](site, _levelled(effect))
        if effect.windows and not change.signals and change != Change():
            raise DescriptionError("has no switch that windows could turn", _told(effect), "give it without windows")
        text = changed(text, change.values, prefix)
        if change.tables:
            text = appended(text, change.tables, _told(effect), prefix)
        signals |= change.signals
        parameters.append(_parameter(change))
        _described(text)
    return Edit(text, signals, tuple(parameters))


def loads_with(run: Run, signals: Mapping[str, Sequence[Window]], name: str = "") -> Run:
    """The run with a column of loads per signal: the level of its windows, in shares of the time until the next row.

    A window belongs to the run of its name, with an empty name to every run. Zero outside of windows.
    name: of the run, that of its folder by default (`run_names` distinguishes runs whose folders have one name).
    """
    own = name or run.folder.resolve().name
    time = run.loads.time
    columns, units = dict(run.loads.columns), dict(run.loads.units)
    until = np.append(time[1:], time[-1:] + (np.median(np.diff(time)) if len(time) > 1 else 1.0))
    for signal, windows in signals.items():
        column = np.zeros(len(time))
        for w in windows:
            if w.run in ("", own):
                inside = np.minimum(until, w.end) - np.maximum(time, w.start)
                column += w.level * np.clip(inside, 0.0, None) / (until - time)
        columns[signal], units[signal] = column, "1"
    return replace(run, loads=replace(run.loads, columns=columns, units=units))


def _parameter(change: Change) -> str:
    """The path of the size of an effect: of the first table that has one, else the last value that changes."""
    for name, _ in change.tables:
        if key := _SIZES.get(name.partition(".")[0]):
            return f"{name}.{key}"
    return next(reversed([*change.values]), "")


def _described(text: str) -> Machine:
    """The machine of a text, without a look at its meshes. Raises DescriptionError for all else that `twin check` finds
    in a description."""
    try:
        machine = Machine.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as e:
        raise DescriptionError(f"not valid TOML: {e}", "machine.toml", "correct it with `twin check`") from e
    except ValidationError as e:
        first = e.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise DescriptionError(f"{first['input']!r}: {first['msg'].lower()}", where, "see docs/description.md") from e
    problems = [p for p in reference_problems(machine) if not p.warning and not _of_a_mesh(p.where)]
    if problems:
        raise DescriptionError.collect(problems)
    return machine


def _of_a_mesh(where: str) -> bool:
    return where.startswith("parts.") and where.endswith(".mesh")


def _levelled(effect: Effect) -> Effect:
    """With windows of levels up to 1: signals of switches end there. The amplitude takes the rest."""
    top = max((w.level for w in effect.windows), default=1.0)
    if any(w.level < 0.0 for w in effect.windows):
        raise DescriptionError("a window of negative level", effect.place, "turn the sign of the amplitude")
    if top <= 1.0:
        return effect
    factor = effect.family == "joint"
    amplitude = 1.0 + (effect.amplitude - 1.0) * top if factor else effect.amplitude * top
    return replace(effect, amplitude=amplitude, windows=tuple(replace(w, level=w.level / top) for w in effect.windows))


def _told(effect: Effect) -> str:
    unit = "" if effect.unit == "1" else f" {effect.unit}"
    return f"{effect.family} at {effect.place}: {effect.amplitude:.4g}{unit}, {effect.history}"


def _nothing(site: Site, effect: Effect) -> Change:
    """The description is not at fault."""
    return Change()


EDITS: dict[str, Callable[[Site, Effect], Change]] = {
    "film_gain": exchange.film_gain,
    "forced_convection": exchange.forced_convection,
    "heat_source": heat.heat_source,
    "loss_law": heat.loss_law,
    "joint": exchange.joint,
    "zone": exchange.zone,
    "sun": heat.sun,
    "coolant": exchange.coolant,
    "sensor": _nothing,
    "signal": scales.signal_factor,
    "scale_expansion": scales.scale_expansion,
    "expansion": scales.expansion,
    "slip": _nothing,
    "capacity": exchange.capacity,
    "initial_state": _nothing,
    "coarse_model": _nothing,
    "measurement": _nothing,
    "misplaced_source": heat.misplaced_source,
    "not_thermal": _nothing,
    "missing_joint": exchange.missing_joint,
}
