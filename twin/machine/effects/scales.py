"""Effects that heat nothing: declarations of signals, expansions of materials and of scales."""

from __future__ import annotations

import math

from twin.errors import DescriptionError
from twin.machine.effects.effect import Effect
from twin.machine.effects.site import Change, Site, figure, named, quantity, surfaces_of
from twin.nearest import did_you_mean

SQRT_HALF = math.sqrt(0.5)


def signal_factor(site: Site, effect: Effect) -> Change:
    """Where the declared kind is the whole story, the kind is corrected; averages and clocks cannot be declared."""
    if effect.history not in ("factor", "always"):
        return Change()
    _, name = named(site, effect.place, "signals")
    entry, path = site.machine.signals[name], f"signals.{name}"
    for kind, other, factor in (("rms", "peak", SQRT_HALF), ("peak", "rms", 1.0 / SQRT_HALF)):
        if entry.kind == kind and math.isclose(effect.amplitude, factor, rel_tol=2e-3):
            return Change(values={f"{path}.kind": other})
    return Change(values={f"{path}.factor": figure(entry.factor * effect.amplitude)})


def scale_expansion(site: Site, effect: Effect) -> Change:
    """The scale of an axis grows; without a place of its own it lies on the axis's first rail."""
    machine, surface, axis = site.machine, str(effect.settings.get("surface", "")), str(effect.settings.get("axis", ""))
    linear = [name for name, entry in machine.axes.items() if entry.kind == "linear"]
    if effect.place.startswith("axes."):
        _, axis = named(site, effect.place, "axes")
        rails = [c.pairs[0][0] for c in machine.contacts.values() if c.axis == axis and c.pairs]
        surface = surface or machine.axes[axis].encoder.scale or (rails[0] if rails else "")
    else:
        surface, axis = effect.place, axis or (linear[0] if len(linear) == 1 else "")
    if axis not in linear:
        raise DescriptionError(f"'{axis}' is no linear axis", effect.place, did_you_mean(axis, linear, "linear axes"))
    (surface,) = surfaces_of(site, surface)
    fixed_at = quantity(float(effect.settings.get("fixed_at", 0.0)), "m")
    entry = {
        "axis": axis, "surface": surface, "expansion": quantity(effect.amplitude, "1/K"), "fixed_at": fixed_at,
    }  # fmt: skip
    return Change(((f"scales.{site.name}", entry),))


def expansion(site: Site, effect: Effect) -> Change:
    """A material grows more or less than declared; that of one part is a material of its own, a node has a row."""
    machine = site.machine
    if effect.place.startswith("tcp.expansion."):
        name = effect.place.removeprefix("tcp.expansion.")
        if name not in machine.tcp.expansion:
            remedy = did_you_mean(name, list(machine.tcp.expansion), "nodes that move the tool")
            raise DescriptionError(f"no '{name}' moves the tool", effect.place, remedy)
        row = [quantity(effect.amplitude * value, "m/K") for value in machine.tcp.expansion[name]]
        return Change(values={effect.place: row})
    section, name = named(site, effect.place, "materials", "parts", "bars")
    if section == "materials":
        return Change(values={f"materials.{name}.expansion": machine.materials[name].expansion * effect.amplitude})
    material = str(getattr(machine, section)[name].material)
    expansion = quantity(machine.materials[material].expansion * effect.amplitude, "1/K")
    copy = (f"materials.{site.name}", {**site.data["materials"][material], "expansion": expansion})
    return Change((copy,), {f"{section}.{name}.material": site.name})
