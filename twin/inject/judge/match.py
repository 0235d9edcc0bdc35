"""Whether what was said of a trial is what was hidden in it: family, place, part, size.

Results are dictionaries as `docs/campaign.jsonl.gz` holds them, one a trial; truths in them are those of `Hidden`.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from twin.inject.experiment import STEPS, Experiment
from twin.machine.bodies import bodies_of

FACTORS = ("film_gain", "loss_law", "joint", "expansion")  # families whose sizes of unit 1 are factors, 1 for nothing
PREFIXES = ("films", "contacts", "sensors", "signals", "sources", "environment", "axes", "tcp", "runs", "parts")
DAY = 86400.0  # s


@dataclass(frozen=True)
class Known:
    """What judging needs to know of the machine, its runs and the catalogue that was searched."""

    described: Mapping[str, Any]  # tables of machine.toml
    bodies: Mapping[str, str]  # part -> body
    top: Callable[[str], float]  # signal -> its largest absolute value in all runs [SI], where histories are one
    families: tuple[str, ...] = ()  # of the catalogue, in its order
    predicts: tuple[str, ...] = ()  # of these, those whose extension is a better model


def known_of(experiment: Experiment, families: Sequence[str] = (), predicts: Sequence[str] = ()) -> Known:
    """Of an experiment, and a catalogue's families."""

    @cache
    def top(signal: str) -> float:
        return max(float(np.abs(run.loads.columns[signal][:STEPS]).max()) for run in experiment.runs)

    bodies = {part: body.name for body in bodies_of(experiment.machine) for part in body.parts}
    return Known(tomllib.loads(experiment.text), bodies, top, tuple(families), tuple(predicts))


def place_of(truth: Mapping[str, Any]) -> str:
    """The place of a hidden thing as a diagnosis calls it."""
    place, settings = str(truth["place"]), truth["settings"]
    if truth["family"] == "initial_state":
        return f"{place}.{settings['body']}"
    if truth["history"] == "frame":
        return f"{place}:{settings['axis']}"
    if truth["history"] == "load":
        return f"{place}:{truth['signal']}"
    if truth["history"] == "swapped":
        return "<>".join([place, settings["other"].removeprefix("sensors.")])
    return place


def same_place(truth: Mapping[str, Any], cause: Mapping[str, Any], known: Known) -> bool:
    """The same name; two swapped sensors in either order; any part of a body that was warm."""
    wanted, said = place_of(truth), str(cause["place"])
    if truth["family"] == "initial_state":  # what moves as one was warmed as one; a diagnosis tells it part by part
        run, _, part = said.rpartition(".")
        return run == str(truth["place"]) and known.bodies.get(part) == truth["settings"]["body"]
    if "<>" in wanted and "<>" in said:
        return _pair(wanted) == _pair(said)
    return wanted == said


def _pair(place: str) -> set[str]:
    return set(place.removeprefix("sensors.").split("<>"))


def parts(place: str, described: Mapping[str, Any]) -> set[str]:
    """What a place belongs to: parts where the description tells, else the name up to its details."""
    head, _, rest = place.partition(".")
    if head not in PREFIXES:
        return {side.partition(".")[0] for side in place.split("<>")}
    name = rest.split(".")[0].split(":")[0].split(">")[0].split("<")[0]
    entry = described.get(head, {}).get(name, {})
    surfaces = [entry[key] for key in ("surface", "part") if key in entry] + list(entry.get("surfaces", ()))
    if head in ("films", "sources") and surfaces:
        return {str(s).partition(".")[0] for s in surfaces}
    if head == "parts":
        return {name}
    return {f"{head}.{name}"}


def same_part(truth: Mapping[str, Any], cause: Mapping[str, Any], known: Known) -> bool:
    """The same place, or one of the same part."""
    own, said = parts(place_of(truth), known.described), parts(str(cause["place"]), known.described)
    return same_place(truth, cause, known) or bool(own & said)


def size_of(truth: Mapping[str, Any], cause: Mapping[str, Any], known: Known) -> float | None:
    """The size of a hidden thing in the words of the cause that was said; None where they cannot be compared.

    Compared are equal units and equal kinds of history (always, in windows, with one signal). Exact factors of signals
    and stuck sensors have no interval and are not compared.
    """
    family, history, size = truth["family"], str(cause["history"]), float(truth["size"])
    if (family == "signal" and history == "factor") or history == "stuck":
        return None
    if family == "sensor" or family == "measurement":
        if truth["history"] != history:  # a drift in every run that was found in one has no size to compare
            return None
        return size * DAY if (truth["unit"], cause["unit"]) == ("K/s", "K/day") else size
    if family == "not_thermal":
        return size if history.startswith(str(truth["history"])) else None
    if truth["unit"] != cause["unit"]:
        return None
    if family == "sun":  # the largest day of those that were looked at
        return size * max((float(w["level"]) for w in truth["windows"][:2]), default=1.0)
    signal = str(truth["signal"])
    if signal:
        if history.split("^")[0] != signal:
            return None
        reference = float(truth["settings"].get("reference", 1.0))
        return size * (known.top(signal) / reference) ** float(truth["exponent"])
    if _windowed(history) != bool(truth["windows"]) or "^" in history:
        return None
    return size


def _windowed(history: str) -> bool:
    return history.startswith("from ")


def covered(truth: Mapping[str, Any], cause: Mapping[str, Any], known: Known) -> bool | None:
    """Whether the 95 % interval of a cause holds the hidden size; None where they cannot be compared."""
    size = size_of(truth, cause, known)
    low, high = cause["ci95"]
    return None if size is None else bool(low <= size <= high)


def effect(truth: Mapping[str, Any], known: Known) -> float:
    """A size as detection limits count it: factors by their distance from one, of losses by their logarithm, signals at
    their top."""
    size = float(truth["size"])
    if truth["family"] == "loss_law" and truth["unit"] == "1":
        return abs(math.log(size))
    if truth["family"] in FACTORS and truth["unit"] == "1":
        return abs(size - 1.0)
    if truth["signal"] and truth["family"] in ("heat_source", "forced_convection"):
        reference = float(truth["settings"].get("reference", 1.0))
        return abs(size) * (known.top(str(truth["signal"])) / reference) ** float(truth["exponent"])
    return abs(size) * (DAY if truth["unit"] == "K/s" else 1.0)


def lead(result: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The first cause that was said."""
    causes: Sequence[Mapping[str, Any]] = result.get("causes") or ()
    return causes[0] if causes else None


def said(result: Mapping[str, Any]) -> str:
    """One word for what was said: the first family, or the verdict where none stands for it."""
    if "error" in result:
        return "error"
    first = lead(result)
    return str(result["verdict"]) if first is None or result["verdict"] == "unknown" else str(first["family"])
