"""Solids as data: prisms added and cut, polygons imprinted, faces named by where they lie. No mesher needed here."""

from __future__ import annotations

import math
from dataclasses import dataclass

Point = tuple[float, float, float]
Span = tuple[float, float]
AXES = "xyz"


@dataclass(frozen=True)
class Prism:
    """A planar polygon swept by a vector."""

    polygon: tuple[Point, ...]
    sweep: Point


@dataclass(frozen=True)
class Patch:
    """A named planar polygon imprinted on the solid's surface."""

    name: str
    polygon: tuple[Point, ...]


@dataclass(frozen=True)
class Region:
    """Names the faces whose bounding box lies within low .. high."""

    name: str
    low: Point
    high: Point


@dataclass(frozen=True)
class Solid:
    """One part. A face belongs to the first patch or region that holds it; the others are called `rest`."""

    name: str
    add: tuple[Prism, ...]
    rest: str
    cut: tuple[Prism, ...] = ()
    patches: tuple[Patch, ...] = ()
    regions: tuple[Region, ...] = ()
    bar: bool = False  # a slim bar, swept along its axis: it gets a regular mesh with one element across


def rectangle(x: float | Span, y: float | Span, z: float | Span) -> tuple[Point, ...]:
    """A rectangle: two arguments are (low, high), the third is the coordinate of its plane."""
    spans = [v if isinstance(v, tuple) else (v, v) for v in (x, y, z)]
    u, v = (i for i, s in enumerate(spans) if s[0] != s[1])
    corners = []
    for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
        point = [s[0] for s in spans]
        point[u], point[v] = spans[u][a], spans[v][b]
        corners.append((point[0], point[1], point[2]))
    return tuple(corners)


def octagon(axis: str, centre: Point, radius: float) -> tuple[Point, ...]:
    """A regular octagon around `centre`, normal to `axis`, flats square to the other axes; radius to the corners."""
    u, v = (i for i in range(3) if AXES[i] != axis)
    corners = []
    for k in range(8):
        point = list(centre)
        point[u] += radius * math.cos(math.pi * (2 * k + 1) / 8)
        point[v] += radius * math.sin(math.pi * (2 * k + 1) / 8)
        corners.append((point[0], point[1], point[2]))
    return tuple(corners)


def block(x: Span, y: Span, z: Span) -> Prism:
    return Prism(rectangle(x, y, z[0]), (0.0, 0.0, z[1] - z[0]))


def along(axis: str, x: Span, y: Span, z: Span) -> Prism:
    """The same as `block`, swept along `axis`."""
    spans: list[float | Span] = [x, y, z]
    i = AXES.index(axis)
    low, high = (x, y, z)[i]
    spans[i] = low
    sweep = [0.0, 0.0, 0.0]
    sweep[i] = high - low
    return Prism(rectangle(spans[0], spans[1], spans[2]), (sweep[0], sweep[1], sweep[2]))


def profile(x: Span, zy: tuple[tuple[float, float], ...]) -> Prism:
    """A side view (z, y) swept over the width x."""
    return Prism(tuple((x[0], y, z) for z, y in zy), (x[1] - x[0], 0.0, 0.0))


def disc(axis: str, centre: Point, radius: float, thickness: float) -> Prism:
    """An octagonal disc from `centre` along `axis`."""
    sweep = [0.0, 0.0, 0.0]
    sweep[AXES.index(axis)] = thickness
    return Prism(octagon(axis, centre, radius), (sweep[0], sweep[1], sweep[2]))


def region(
    name: str, x: float | Span | None = None, y: float | Span | None = None, z: float | Span | None = None
) -> Region:
    """`region("left", x=-0.45)`: faces in a plane; `region("bracket", x=(0.8, 0.9), z=(0, 1))`: within a box."""
    infinity = float("inf")
    low, high = [-infinity] * 3, [infinity] * 3
    for i, span in enumerate((x, y, z)):
        if span is not None:
            low[i], high[i] = span if isinstance(span, tuple) else (span, span)
    return Region(name, (low[0], low[1], low[2]), (high[0], high[1], high[2]))


def around(centre: float, width: float) -> Span:
    return (centre - width / 2, centre + width / 2)
