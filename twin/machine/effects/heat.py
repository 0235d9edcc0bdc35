"""Effects that heat, written as sources of a description; amplitudes mean what the table of `edits` says."""

from __future__ import annotations

from dataclasses import replace

from twin.errors import DescriptionError
from twin.machine.effects.effect import Effect
from twin.machine.effects.site import Change, Site, figure, largest, named, quantity, signal_of, surfaces_of, switch_of

_REMEDY_SIGNAL = "wire a current (A), a speed (m/s, 1/s), a power (W) or a switch (1)"


def heat_source(site: Site, effect: Effect) -> Change:
    """Something heats that the description does not know."""
    place = _source_place(site, effect.place)
    heat, switch = _heat(site, effect)
    return replace(switch, tables=((f"sources.{site.name}", {"law": heat["law"], **place, **heat}), *switch.tables))


def sun(site: Site, effect: Effect) -> Change:
    """The sun, or a heater that switches, shines on a surface."""
    if not (effect.windows or effect.signal):
        raise DescriptionError("needs a profile", f"sun at {effect.place}", "give windows, or a signal of unit 1")
    return heat_source(site, effect)


def loss_law(site: Site, effect: Effect) -> Change:
    """A source heats more or less than its law says, or by another power of its speed."""
    _, name = named(site, effect.place, "sources")
    source = site.machine.sources[name]
    if not effect.signal:
        return Change(values={f"sources.{name}.gain": source.gain * effect.amplitude})
    heat, switch = _heat(site, effect)
    place = {"contact": source.contact, "rail_share": source.rail_share} if source.contact else {
        "surface": source.surface
    }  # fmt: skip
    gain = source.gain * float(effect.settings.get("gain", 0.0))
    table = (f"sources.{site.name}", {"law": heat["law"], **place, **heat})
    return replace(switch, tables=(table, *switch.tables), values={f"sources.{name}.gain": gain})


def misplaced_source(site: Site, effect: Effect) -> Change:
    """A source heats another surface."""
    _, name = named(site, effect.place, "sources")
    if site.machine.sources[name].surface is None:
        raise DescriptionError("heats a moving contact, not a surface", effect.place, "it has no place to be wrong")
    (surface, *_) = surfaces_of(site, str(effect.settings.get("surface", "")))
    return Change(values={f"sources.{name}.surface": surface})


def _heat(site: Site, effect: Effect) -> tuple[dict[str, object], Change]:
    """Law, parameters and signals of a source that follows an effect's history."""
    power = effect.amplitude
    if not effect.signal or signal_of(site, effect)[1] == "1":
        name, switch = switch_of(site, effect)
        if not name:
            return {"law": "constant_heat", "parameters": {"power": quantity(power, "W")}}, switch
        law: dict[str, object] = {"law": "switched_heat", "parameters": {"power": quantity(power, "W")}}
        return {**law, "signals": {"switch": name}}, switch
    name, unit = signal_of(site, effect)
    reference = float(effect.settings.get("reference", 0.0)) or largest(site.machine, name)
    if unit in ("m/s", "1/s"):
        parameters = {
            "power": quantity(power, "W"), "reference": quantity(reference, unit), "exponent": effect.exponent,
        }  # fmt: skip
        law = {"law": "speed_heat" if unit == "m/s" else "turning_heat", "parameters": parameters}
        return {**law, "signals": {"speed": name}}, Change()
    if unit == "A" and effect.exponent == 2.0:
        resistance = power / (3.0 * reference**2)  # motor_copper: P = 3 R I^2
        law = {"law": "motor_copper", "parameters": {"resistance": quantity(resistance, "ohm")}}
        return {**law, "signals": {"current": name}}, Change()
    if unit == "W" and effect.exponent == 1.0:
        law = {"law": "power_share", "parameters": {"share": figure(power / reference)}}
        return {**law, "signals": {"power": name}}, Change()
    raise DescriptionError(f"no law heats with {name}^{effect.exponent:g} [{unit}]", effect.place, _REMEDY_SIGNAL)


def _source_place(site: Site, place: str) -> dict[str, object]:
    """Where a source acts: the heat of a moving contact's place goes into its pads."""
    (surface, *_) = surfaces_of(site, place)
    return {"contact": place.partition(".")[2], "rail_share": 0.0} if place.startswith("contacts.") else {
        "surface": surface
    }  # fmt: skip
