"""What a page shows of a machine whatever has been computed: names, poses, surface, certificate."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from typing import Any

import numpy as np

from twin.errors import ModelError
from twin.page.creases import creases
from twin.page.packed import packed
from twin.page.shape import Shape
from twin.page.words import CAUTION
from twin.rom.artefact import Artefact
from twin.rom.certificate_table import table
from twin.rom.turned_surface import surface_turns
from twin.run.correction_axes import axis_jacobian


def machine_told(artefact: Artefact, shape: Shape | None) -> dict[str, Any]:
    """As JSON. Lengths in m, temperatures in degC."""
    model = artefact.model
    air = {name for name, _ in model.ambient_sensors}
    named = tomllib.loads(artefact.description).get("machine", {}) if artefact.description else {}
    return {
        "name": model.name,
        "description": named.get("description", ""),
        "vertical": "xyz".index(named.get("vertical", "z")),
        "artefact": artefact.digest,
        "created": artefact.created,
        "states": model.n,
        "reference": model.reference_temperature,
        "sensors": [{"name": name, "air": name in air} for name in (*model.sensors, *air_names(artefact))],
        "workspace": _workspace(artefact) if model.moves else None,
        "surface": _surface(artefact, shape) if artefact.fields else None,
        "certificate": _certificate(artefact),
        "missing": missing(artefact, shape),
    }


def air_names(artefact: Artefact) -> tuple[str, ...]:
    """Sensors in air, in the order of results."""
    return tuple(name for name, _ in artefact.model.ambient_sensors)


def missing(artefact: Artefact, shape: Shape | None) -> list[str]:
    """What cannot be drawn, and why."""
    found = []
    if not artefact.fields:
        found.append("lumped machine: no surface to draw")
    elif shape is None:
        found.append("the artefact has no elastic structure: the surface is drawn undeformed")
    if not artefact.model.moves:
        lumped = any(key in tomllib.loads(artefact.description or "") for key in ("nodes", "bars"))
        keys = (
            "[tcp.expansion] and no [tcp.screws]" if lumped and not artefact.fields else "[tcp.tool] and no [tcp.work]"
        )
        found.append(f"no temperature moves the tool: the description has no {keys}")
    return found


def in_space(artefact: Artefact, axes: Sequence[str], positions: np.ndarray) -> np.ndarray:
    """The tool's place as seen from the work (n, 3) [m] at positions (n, n_axes) [m]; zero at position zero."""
    try:
        return positions @ axis_jacobian(artefact, axes).T
    except ModelError:  # an axis that moves neither side, or none: drawn along the coordinates
        return np.pad(positions, ((0, 0), (0, 3)))[:, :3]


def _workspace(artefact: Artefact) -> dict[str, Any]:
    model = artefact.model
    count = len(model.poses) - model.scattered
    return {
        "axes": list(model.pose_axes),
        "grid": [nodes.tolist() for nodes in model.pose_grid],
        "places": packed(in_space(artefact, model.pose_axes, model.poses[:count])),
        "poses": count,
    }


def _surface(artefact: Artefact, shape: Shape | None) -> dict[str, Any]:
    """Bodies one after the other; shifts: (n_fields, n_axes, 3) m/m by the linear axes."""
    first = np.cumsum([0, *(len(f.nodes) for f in artefact.fields)])
    triangles = np.vstack([f.triangles + n for f, n in zip(artefact.fields, first, strict=False)])
    edges = np.vstack([creases(f.nodes, f.triangles) + n for f, n in zip(artefact.fields, first, strict=False)])
    names = [b.name for b in artefact.model.bodies]
    rows = [names.index(f.body) for f in artefact.fields]
    return {
        "bodies": [f.body for f in artefact.fields],
        "first": first.tolist(),
        "points": packed(np.vstack([f.nodes for f in artefact.fields])),
        "triangles": packed(triangles, "u4"),
        "edges": packed(edges, "u4"),
        "axes": list(shape.structure.axes) if shape else [],
        "shifts": shape.structure.system.shifts[rows].tolist() if shape else [],
        "turns": _turns(artefact),
        "deforms": shape is not None,
    }


def _turns(artefact: Artefact) -> list[dict[str, Any]]:
    """Rotary axes, each after the one that it stands on, with the nodes of the surface that it turns."""
    turned = [field.turned for field in artefact.fields]
    return [
        {
            "direction": turn.direction.tolist(),
            "point": turn.point.tolist(),
            "nodes": packed(np.flatnonzero(np.concatenate([own[k] for own in turned if own is not None])), "u4"),
        }
        for k, turn in enumerate(surface_turns(artefact.model, artefact.fields))
    ]


def _certificate(artefact: Artefact) -> dict[str, Any]:
    c = artefact.certificate
    if not c:
        return {"passed": False, "table": [], "words": "no certificate", "caution": CAUTION}
    words = f"{len(c['scenarios'])} held-out scenarios of {c['hours']:g} h; sensors in K, TCP in µm"
    rows = [re.split(r"\s{2,}", line.strip()) for line in table(c)]
    return {"passed": bool(c.get("passed")), "table": rows, "words": words, "caution": CAUTION}
