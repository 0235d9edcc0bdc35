"""What the process beside the machine must know of an artefact besides how to step it: names, limits, poses, axes.

Plain numbers and lists, so that a process that steps the machine in C needs neither NumPy nor HDF5 to read them.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from twin.errors import TwinError

FACTS_VERSION = 2
FACTS, LIBRARY = "facts.json", "machine.so"  # files of a compiled machine


@dataclass(frozen=True)
class Channel:
    """A load signal."""

    column: str  # header in logs without the unit
    unit: str  # SI
    needed: bool  # something reads it
    default: float | None  # SI; None: a log must have it
    low: float  # certified range
    high: float
    axis: str = ""  # whose position it is


@dataclass(frozen=True)
class Axis:
    """A linear axis that corrects."""

    name: str
    centre: float  # m, of the poses
    half_range: float  # m, > 0
    degree: int  # of the polynomial along it


@dataclass(frozen=True)
class Facts:
    """Of an artefact; n poses on the grid in C order, a axes, c coefficients."""

    machine: str
    digest: str  # sha256 of the model
    prefix: str  # of the names in its C code
    step: float  # s, certified
    reference_temperature: float  # degC
    channels: tuple[Channel, ...]
    axis_channels: tuple[int, ...]  # of every linear axis: its position
    strokes: tuple[tuple[float, float], ...]  # m, of the same axes: lowest and highest position
    air: int  # channel of the temperature a machine at rest has; -1: `air_temperature` at all times
    air_temperature: float  # degC
    sensors: tuple[str, ...]
    flags: tuple[str, ...]  # of the C code
    poses: int  # of the grid
    all_poses: int  # with those scattered in the workspace, which come after
    pose_grid: tuple[tuple[float, ...], ...]  # m, per axis
    axes: tuple[Axis, ...]
    offset_per_error: tuple[tuple[float, ...], ...]  # (a, 3) per TCP displacement, or (6, 6) per strut error
    fit: tuple[tuple[float, ...], ...]  # (c, n): coefficients = fit @ values at the poses
    certificate: str  # in words


def write_facts(path: Path, facts: Facts) -> None:
    """As JSON. Raises OSError."""
    path.write_text(json.dumps({"version": FACTS_VERSION, **asdict(facts)}), encoding="utf-8")


def read_facts(path: Path) -> Facts:
    """The inverse. Raises TwinError where the file is not ours."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        if told.pop("version") != FACTS_VERSION:
            raise ValueError("another version")
        return _frozen(told)
    except (OSError, ValueError, KeyError, TypeError) as e:
        raise TwinError(f"cannot be read: {e}", str(path), "remove the folder: it is made again") from e


def _frozen(told: dict[str, Any]) -> Facts:
    channels = tuple(Channel(**c) for c in told.pop("channels"))
    axes = tuple(Axis(**a) for a in told.pop("axes"))
    return Facts(channels=channels, axes=axes, **{k: _tuple(v) for k, v in told.items()})


def _tuple(value: Any) -> Any:
    return tuple(_tuple(v) for v in value) if isinstance(value, list) else value
