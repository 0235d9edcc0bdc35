"""What the picture of a place shows: the machine as it is drawn, the place in it, and the channels that told it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Shell:
    """The outer surface of a meshed machine."""

    points: np.ndarray  # (n, 3) m
    triangles: np.ndarray  # (m, 3)
    part: np.ndarray  # (m,) int
    surface: np.ndarray  # (m,) int, of `names`
    names: tuple[str, ...]  # "bed.left"


@dataclass(frozen=True)
class Network:
    """The nodes of a lumped machine."""

    nodes: tuple[str, ...]
    bars: tuple[str, ...]  # those of the nodes that are bars
    links: tuple[tuple[str, str, bool], ...]  # and whether the contact moves


@dataclass(frozen=True)
class Scene:
    machine: Shell | Network
    vertical: int  # the axis that points up
    marked: tuple[str, ...]  # surfaces or nodes of the place
    sensors: Mapping[str, str | Point]  # on nodes, or where they are [m]
    place: str  # as a cause tells it


@dataclass(frozen=True)
class Support:
    """What tells the first cause, the strongest channel first."""

    shares: tuple[tuple[str, float], ...]  # channel ("dx" of the TCP), share of the statistic: 1 in all
    participation: float  # channels that carry it
