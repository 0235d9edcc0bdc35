"""What an artefact holds and how good it is, as JSON values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from twin.rom.artefact import Artefact


def facts(artefact: Artefact) -> dict[str, Any]:
    """Orders, poses, parameters with their certified ranges, certificate and provenance (SI)."""
    model = artefact.model
    load = model.load_model

    def use(owner: str, law: Any) -> dict[str, Any]:
        return {f"{owner}.{name}": value for name, value in law.parameters.items()}

    parameters: dict[str, float] = {}
    for source in load.sources:
        parameters |= use(f"sources.{source.name}", source.use) | {f"sources.{source.name}.gain": source.gain}
    for film in load.films:
        owner = f"films.{film.name}"
        parameters |= use(owner, film.use) | {f"{owner}.gain": film.gain, f"{owner}.emissivity": film.emissivity}
    for joint in load.joints:
        parameters[f"contacts.{joint.name}.{joint.key}"] = joint.conductance
    for pair in load.pairs:
        parameters[f"contacts.{pair.contact}.{pair.key}"] = pair.conductance
    unit = {"conductance": "W/(m^2*K)", "total": "W/K"}
    terms = [*((f"films.{f.name}", f.low, f.high, unit["conductance"]) for f in load.films),
             *((f"contacts.{j.name}.{j.key}", j.low, j.high, unit[j.key]) for j in load.joints)]  # fmt: skip
    return {
        "name": model.name,
        "created": artefact.created,
        "model_sha256": artefact.digest,
        "reference_temperature_degC": model.reference_temperature,
        "states": model.n,
        "bodies": [
            {
                "name": b.name,
                "states": b.n,
                "ports": len(b.ports),
                "sources": [load.sources[i].name for i in b.sources],
                "sensors": [model.sensors[i] for i in b.sensors],
                "projection": "galerkin" if b.symmetric else "oblique",
            }
            for b in model.bodies
        ],
        "poses": len(model.poses),
        "pose_grid_m": {axis: grid.tolist() for axis, grid in zip(model.pose_axes, model.pose_grid, strict=True)},
        "sensors": list(model.all_sensors),
        "parameters": parameters,
        "certified_ranges": {
            "signals": {
                s.name: {"low": s.low, "high": s.high, "unit": s.unit, "column": s.column} for s in load.signals
            },
            "coefficients": {name: {"low": low, "high": high, "unit": u} for name, low, high, u in terms},
        },
        "certificate": {
            name: value if not hasattr(value, "tolist") else value.tolist()
            for name, value in artefact.certificate.items()
        },
        "pictures": [field.body for field in artefact.fields],
        "provenance": artefact.provenance,
    }
