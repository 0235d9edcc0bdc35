"""The content of the page of a finished run: every step, small enough for one file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twin.page.correction import correction_told
from twin.page.low_rank import low_rank
from twin.page.machine import machine_told
from twin.page.measured import measured_told
from twin.page.packed import packed
from twin.page.shape import Shape, axis_positions, shape_of
from twin.page.words import flag_words, trust
from twin.pictures.result import Drawn, read_result
from twin.rom.artefact import Artefact
from twin.rom.tcp import by_body

VERSION = 1  # of the content
MOST = 1500  # steps that are drawn; of longer runs every second, third ...
KELVIN, METRE = 0.02, 1e-7  # largest error of a drawn temperature and displacement of the surface
TCP = 2e-8  # m, of the TCP error: results are told to 0.1 um


def finished_told(artefact: Artefact, folder: Path) -> dict[str, Any]:
    """The result of `twin run` in `folder` as JSON. Raises TwinError where it is none, or none of this artefact."""
    result = read_result(folder, artefact)
    every = -(-len(result.hours) // MOST)
    rows = np.unique(np.r_[np.arange(0, len(result.hours), every), len(result.hours) - 1])
    shape = shape_of(artefact)
    machine = machine_told(artefact, shape)
    flagged = int(result.outside.sum())
    raised = [name for name, column in zip(result.flag_names, result.flags.T, strict=True) if column.any()]
    level, line = trust(artefact.certificate, flagged, len(result.hours) - 1, raised)
    if every > 1:
        machine["missing"].append(f"every {every}th of {len(result.hours)} times is drawn; the files have all")
    return {
        "version": VERSION,
        "mode": "finished",
        "title": f"{artefact.model.name}: result",
        "subtitle": result.run or Path(folder).name,
        "machine": machine,
        "trust": {"level": level, "line": line},
        "hours": packed(result.hours[rows]),
        "temperature": packed(result.temperature[rows]),
        "outside": packed(result.outside[rows].astype(float)),
        "tcp": _tcp(artefact, result, rows) if artefact.model.moves else None,
        "surface": _surface(artefact, shape, result, rows) if artefact.fields else None,
        "measured": measured_told(Path(result.run), result, rows) if result.run else None,
        "flags": _flags(result),
        "correction": correction_told(artefact, Path(folder) / "correction.json"),
        "facts": _facts(artefact, result, flagged),
        "files": [name for name in _FILES if (Path(folder) / name).is_file()],
    }


_FILES = (
    "result.h5", "temperatures.csv", "tcp.csv", "summary.json",
    "temperatures.png", "tcp.png", "workspace.png", "surface.png",
)  # fmt: skip


def _tcp(artefact: Artefact, result: Drawn, rows: np.ndarray) -> dict[str, Any]:
    count = len(artefact.model.poses) - artefact.model.scattered
    tcp = result.tcp[rows, :count]
    return {
        "field": low_rank(tcp.reshape(len(rows), -1).T, TCP).told(),
        "actual": packed(result.tcp_actual[rows]),
        "axes": list(result.axes),
        "position": packed(result.position[rows]),
        "worst": int(np.abs(tcp).max(axis=(1, 2)).argmax()),
        "middle": result.middle if result.middle < count else 0,
    }


def _surface(artefact: Artefact, shape: Shape | None, result: Drawn, rows: np.ndarray) -> dict[str, Any]:
    """Temperatures and displacements of all bodies, each in modes of its own."""
    model = artefact.model
    names = [b.name for b in model.bodies]
    states = by_body(model, result.states[rows])
    temperatures = [
        low_rank(model.reference_temperature + field.basis @ states[names.index(field.body)].T, KELVIN)
        for field in artefact.fields
    ]
    told: dict[str, Any] = {
        "temperature": [t.told() for t in temperatures],
        "temperature_error": max(t.error for t in temperatures),
        "position": packed(np.zeros((len(rows), 0))),
        "angle": packed(result.angle[rows]),
        "displacement": None,
    }
    if shape is not None:
        position = axis_positions(shape.structure, result.axes, result.position[rows])
        moved = shape(result.states[rows], position)
        displacements = [low_rank(u.reshape(len(rows), -1).T, METRE) for u in moved]
        told["displacement"] = [u.told() for u in displacements]
        told["displacement_error"] = max(u.error for u in displacements)
        told["position"] = packed(position)
    return told


def _flags(result: Drawn) -> list[dict[str, Any]]:
    """Every flag that was raised: what it means, in how many steps, and when [h]."""
    found = []
    for name, column in zip(result.flag_names, result.flags.T, strict=True):
        if column.any():
            edges = np.flatnonzero(np.diff(np.r_[False, column, False].astype(int)))
            spans = [[float(result.hours[a]), float(result.hours[b])] for a, b in edges.reshape(-1, 2)]
            found.append({"name": name, "words": flag_words(name), "steps": int(column.sum()), "spans": spans[:20]})
    return found


def _facts(artefact: Artefact, result: Drawn, flagged: int) -> list[str]:
    model = artefact.model
    facts = [
        f"{len(result.hours) - 1} steps over {result.hours[-1]:.3g} h",
        f"{model.n} states, {len(result.poses)} poses, {len(result.sensors)} sensors",
    ]
    if model.moves:
        time, _, component = np.unravel_index(np.abs(result.tcp).argmax(), result.tcp.shape)
        worst = 1e6 * result.tcp.flat[np.abs(result.tcp).argmax()]
        facts.append(f"largest TCP error {worst:+.1f} µm in {'xyz'[component]} after {result.hours[time]:.2f} h")
    facts.append(f"{flagged} steps outside the certified box")
    return facts
