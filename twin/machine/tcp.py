"""What carries the tool centre point: two surfaces, what each temperature moves it by, or a platform on six struts."""

from __future__ import annotations

from typing import Literal

from twin.machine.quantities import DisplacementPerKelvin, Entry, Point


class TcpSide(Entry):
    """The patch whose mean displacement and tilt carry the point (paper 000, Fig. 6)."""

    surface: str  # "part.surface"
    point: Point | None = None  # tool side only: the tool centre point at axis positions zero


class Strut(Entry):
    """Of a parallel machine: what sets the distance between a joint on the frame and one on the platform."""

    axis: str  # linear: its position zero is the length between `base` and `joint`, positive is longer
    base: Point  # centre of the joint on the frame
    joint: Point  # of that on the platform, at axis positions zero
    screw: str  # bar; from its fixed end to the nut it adds its growth to the length
    growth: dict[str, DisplacementPerKelvin] = {}  # m/K that the strut gains per kelvin of a node, or of a bar's mean


class Platform(Entry):
    """Of a parallel machine: a platform that six [struts] carry."""

    side: Literal["tool", "work"] = "tool"  # that it carries
    point: Point  # tool centre point at axis positions zero
    moving: str | None = None  # node whose expansion spreads the joints of the platform about the point
    frame: str | None = None  # node whose expansion spreads the joints of the frame about `ground`
    ground: Point = (0.0, 0.0, 0.0)  # where the frame holds the other side


class Tcp(Entry):
    """The two sides of the TCP; of a lumped machine what each temperature moves the tool by, as seen from the work."""

    tool: TcpSide = TcpSide(surface="")  # both sides are needed where there are parts
    work: TcpSide = TcpSide(surface="")
    # TCP displacement along x, y, z per kelvin of a node, or of a bar's mean
    expansion: dict[str, tuple[DisplacementPerKelvin, DisplacementPerKelvin, DisplacementPerKelvin]] = {}
    # lumped machines: bars that position an axis; the screw grows from its fixed end, and its nut holds this side
    screws: dict[str, Literal["tool", "work"]] = {}
    platform: Platform | None = None  # lumped machines: what six struts carry, instead of screws
