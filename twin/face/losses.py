"""The heat of every source, the coefficient of every film, and where they come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.face.inputs import run_of
from twin.face.machine import Machine, load

if TYPE_CHECKING:
    from twin.logs.run import Run
    from twin.machine.explain import Explanation, Load


@dataclass(frozen=True)
class Losses:
    """Laws of a machine evaluated at a load."""

    load: Load
    laws: tuple[Explanation, ...]

    def facts(self) -> list[dict[str, Any]]:
        """One entry per law, JSON values (SI)."""
        return [law_facts(one, self.load) for one in self.laws]


def losses(
    machine: Machine | str | Path,
    path: str | None = None,
    run: Run | str | Path | None = None,
    settings: Mapping[str, str] = {},
) -> Losses:
    """The laws of a machine, or the one at `path` ("sources.x_motor"), at one load: every signal at the upper bound of
    its certified range, or at every sample of a run. settings: signals, or temperature, surface and ambient of the
    model, with units. Raises TwinError for unknown paths and names.
    """
    from twin.machine.explain import explain, load_of, paths

    described = load(machine).description
    at = load_of(described, dict(settings), None if run is None else run_of(run))
    chosen = paths(described) if path is None else [path]
    return Losses(at, tuple(explain(described, p, at) for p in chosen))


def over_time(one: Explanation, load: Load) -> dict[str, float]:
    """Mean and maximum, and of heat its energy."""
    values = whole(one.value, load)
    told = {"mean": load.mean(values), "max": float(values.max())}
    if one.unit == "W":
        told["energy_J"] = told["mean"] * float(load.time[-1] - load.time[0])
    return told


def whole(values: Any, load: Load) -> Any:
    """One value per sample of the load."""
    import numpy as np

    return np.broadcast_to(values, load.time.shape)


def law_facts(one: Explanation, load: Load) -> dict[str, Any]:
    """One law as JSON values, SI."""
    told: dict[str, Any] = {"path": one.path, "kind": one.kind, "law": one.law or None, "formula": one.formula,
                            "source": one.citation, "acts_on": one.place, "unit": one.unit}  # fmt: skip
    told["inputs"] = [
        {"name": i.name, "unit": i.unit, "meaning": i.meaning, "origin": i.origin, **_statistics(i.value, load)}
        for i in one.inputs
    ]
    told["result"] = over_time(one, load) if len(load.time) > 1 else {"value": float(one.value[0])}
    if one.radiation is not None:
        told["radiation"] = _statistics(one.radiation, load)
    told["validity"] = one.validity or None
    told["holds"] = bool(one.holds.all())
    told["samples_outside"] = int((~whole(one.holds, load)).sum())
    return told


def _statistics(values: Any, load: Load) -> dict[str, float]:
    every = whole(values, load)
    if float(every.min()) == float(every.max()):
        return {"value": float(every[0])}
    return {"mean": load.mean(every), "min": float(every.min()), "max": float(every.max())}
