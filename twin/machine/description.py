"""The machine description (machine.toml) as validated, frozen types; SI inside.

Numbers are SI or strings with a unit ("120 mm", "25 W/(m^2*K)"). Everything physics happens in has a name, and its
dotted path ("contacts.x_guide.conductance") is that parameter's name in artefacts, fits and reports.
All part meshes are in machine coordinates [m] with every axis at position zero.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

from pydantic import Field

from twin.machine.quantities import (
    Acceleration,
    Area,
    Capacity,
    Conductance,
    Conductivity,
    Density,
    Entry,
    Expansion,
    FilmCoefficient,
    HeatCapacity,
    Jerk,
    Length,
    Mass,
    Point,
    Pressure,
    Speed,
    Stiffness,
    Surroundings,
    Temperature,
    TemperatureDifference,
    TemperatureGradient,
    Vector,
    Volume,
)
from twin.machine.tcp import Strut, Tcp

# W/(m^2 K), and W/K of lumped machines: a micrometre of copper has 4e8. Tighter contacts are one part, and beside them
# whatever else conducts is lost to rounding.
TIGHTEST = 1e9
BOX_SURFACES = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


def _not_given() -> float:
    return math.nan


class Material(Entry):
    conductivity: Conductivity = Field(gt=0)
    density: Density = Field(gt=0)
    heat_capacity: HeatCapacity = Field(gt=0)
    # needed of parts where the machine has a TCP; nodes and bars need an expansion at most, as screws
    youngs_modulus: Pressure = Field(default_factory=_not_given, gt=0)
    poisson_ratio: float = Field(default_factory=_not_given, gt=-1, lt=0.5)
    expansion: Expansion = Field(default_factory=_not_given)


class Box(Entry):
    """A solid given as a box: structured tetrahedra, surfaces x_min, x_max, y_min, y_max, z_min, z_max."""

    origin: Point
    size: Point
    divisions: tuple[int, int, int]


class Part(Entry):
    material: str
    mesh: str | None = None  # path relative to machine.toml
    mesh_unit: str = "m"  # "mm" scales the mesh; `twin check` finds meshes that look scaled wrongly
    box: Box | None = None
    adiabatic: tuple[str, ...] = ()  # surfaces without heat exchange


class Node(Entry):
    """A capacity at one temperature. Of a lumped machine without a film it exchanges heat through contacts only; beside
    parts nothing but films and sources reaches it (`twin.machine.free_nodes`)."""

    capacity: Capacity | None = Field(None, gt=0)  # or a material with a volume or a mass
    material: str | None = None
    volume: Volume | None = Field(None, gt=0)
    mass: Mass | None = Field(None, gt=0)
    area: Area | None = Field(None, gt=0)  # that films exchange heat through
    position: Point | None = None  # at axis positions zero; of pads, and where the air is warmer above


class Bar(Entry):
    """Of a lumped machine: a straight one-dimensional conductor, such as a ball screw.

    It conducts along its length and exchanges heat through its mantle; its end faces are adiabatic unless a fixed
    contact names them, as "NAME.start" and "NAME.end".
    """

    material: str
    origin: Point  # of its start, at axis positions zero
    direction: Vector
    length: Length = Field(gt=0)
    cross_section: Area = Field(gt=0)
    perimeter: Length | None = Field(None, gt=0)  # times the length: the area of films
    elements: int = Field(12, ge=2, le=10_000)  # of equal length; linear temperatures between their ends
    # of a screw: the fixed bearing, from which it grows; both: two that do not yield, between which it is compressed
    fixed_end: Literal["start", "end", "both"] = "start"


class Encoder(Entry):
    """What the control of a linear axis reads its position from (paper 004, eq 27).

    rotary: the motor's angle; the screw is the scale. linear: a scale on one side of the guide and a reader on the
    other; the control keeps the reader at the scale's mark, whatever the screw does.
    """

    kind: Literal["rotary", "linear"] = "rotary"
    scale: str | None = None  # linear: "part.surface" whose temperature the scale takes and which holds it
    reader: str | None = None  # linear: "part.surface" on the other side of the guide that carries the reading head
    fixed_at: Length = 0.0  # linear: coordinate along the axis of the scale's fixing point, machine coordinates
    expansion: Expansion = 0.0  # linear: 1/K of the scale's material


class Axis(Entry):
    kind: Literal["linear", "rotary"] = "linear"
    direction: Vector
    stroke: tuple[Length, Length] = (0.0, 0.0)  # of rotary axes the range of their signal stands for it
    point: Point | None = None  # rotary axes: a point on the axis, at axis positions zero; with it the structure turns
    carries: tuple[str, ...]  # parts that move with the axis (their whole bodies do)
    position: str  # signal
    encoder: Encoder = Encoder()
    speed: Speed | None = Field(None, gt=0)  # limits of the drive: with them `twin check RUN` judges the log's sampling
    acceleration: Acceleration | None = Field(None, gt=0)
    jerk: Jerk | None = Field(None, gt=0)


class StiffnessOfPair(Entry):
    """Per pair, along: the axis, the pad's surface normal, and normal x axis. Zero means free."""

    axial: Stiffness = Field(0.0, ge=0)
    normal: Stiffness = Field(0.0, ge=0)
    lateral: Stiffness = Field(0.0, ge=0)


class JointLaw(Entry):
    """The conductance of a fixed joint by a law of kind "joint", from roughness, hardness and bolts (004 eqs 7-10)."""

    law: str
    gain: float = Field(1.0, gt=0)  # calibration factor of the law
    parameters: dict[str, float | str] = {}


class Contact(Entry):
    """fixed: two surfaces glued, meshes need not match; or across a gap, which passes heat and no force. moving: pads
    (carriages, nuts) on rails or screws.

    Of a lumped machine, `surfaces` are nodes or ends of bars, and a pair is (bar, node).
    """

    kind: Literal["fixed", "moving"]
    surfaces: tuple[str, str] | None = None  # fixed: "part.surface" twice
    axis: str | None = None  # moving
    pairs: tuple[tuple[str, str], ...] = ()  # moving: (rail "part.surface", pad "part.surface")
    segments: int = Field(12, ge=2)  # moving: stations along each rail
    assignment: Literal["interpolated", "segment"] = "interpolated"  # moving: between stations, or to the segment below
    conductance: FilmCoefficient | None = Field(None, gt=0, le=TIGHTEST)  # of the joint, or per pad area
    area: Area | None = Field(None, gt=0)  # lumped machines: of the joint, or of each pad
    total: Conductance | None = Field(
        None, gt=0, le=TIGHTEST
    )  # lumped machines: of the joint or each pad, instead of both
    joint: JointLaw | None = None  # fixed: instead of `conductance`
    # fixed: the surfaces face each other, up to this far apart, and pass heat alone: an air gap, a shim
    gap: Length | None = Field(None, gt=0)
    switch: str | None = None  # signal 0 .. 1: a clamp, a preload, an oil film
    switched: float | None = Field(None, gt=0)  # factor of the conductance where the switch is 1, in shares between
    stiffness: StiffnessOfPair = StiffnessOfPair()  # moving; fixed joints are glued

    @property
    def glues(self) -> bool:
        """Whether it joins two surfaces that lie on each other, which then move as one."""
        return self.kind == "fixed" and self.gap is None


class Tank(Entry):
    """A heat capacity behind a conductance that meshes lack: an oil tank, a workpiece. It does not grow."""

    surface: str  # "part.surface"; of a lumped machine a node, a bar, or an end of a bar
    capacity: Capacity = Field(gt=0)
    conductance: Conductance = Field(gt=0)


class Scale(Entry):
    """Growth of an encoder's scale that the description lacks otherwise (`twin.build.scales` for its sign)."""

    axis: str  # linear
    surface: str  # "part.surface" whose mean temperature the scale takes; of a lumped machine a node, bar, or end of it
    expansion: Expansion = Field(ge=-1e-3, le=1e-3)
    fixed_at: Length = 0.0  # position of the axis at which the scale's growth moves nothing


class Source(Entry):
    law: str
    surface: str | None = None  # "part.surface"; of a lumped machine a node, a bar, or an end of a bar
    contact: str | None = None  # a moving contact: heat goes to its rails (by dwell time) and pads
    rail_share: float = Field(0.5, ge=0, le=1)
    gain: float = Field(1.0, ge=0)
    parameters: dict[str, float | str] = {}
    signals: dict[str, str] = {}


class Film(Entry):
    """Convection by a law, and radiation, which is on by default."""

    law: str
    # "part.surface", or "part.*" for every surface of the part not used elsewhere; of a lumped machine nodes and bars
    surfaces: tuple[str, ...] = Field(min_length=1)
    each: Literal["part", "surface"] | None = None  # a film of its own for each: the loader writes them out
    area: Area | None = Field(None, gt=0)  # lumped machines: of a node that exchanges heat through several films
    environment: str
    gain: float = Field(1.0, gt=0)  # calibration factor of the convection
    emissivity: float | None = Field(None, ge=0, le=1)  # 0.9 (paint) by default, 0 for channels of a coolant
    radiant: str | None = None  # environment at the radiant temperature, the film's own by default
    additional: bool = False  # on top of what its surfaces exchange already, by convection alone
    parameters: dict[str, float | str] = {}
    signals: dict[str, str] = {}


class Environment(Entry):
    """Air of a zone, a radiant surrounding, or a coolant at its inlet."""

    signal: str | None = None
    temperature: Surroundings | None = None  # constant, where no signal is given
    gradient: TemperatureGradient = 0.0  # warmer by this per metre above `height`
    height: Length = 0.0  # vertical machine coordinate at which the temperature is measured
    # added to it: of a sensor that reads wrong by a constant, or of air that differs from where it is measured
    offset: TemperatureDifference = 0.0
    switch: str | None = None  # signal 0 .. 1: a door, a fan, a machine beside it
    switched_offset: TemperatureDifference = 0.0  # added to it where the switch is 1, in shares between


class SignalEntry(Entry):
    column: str | None = None  # header in loads.csv, the signal's own name by default
    unit: str
    kind: Literal["value", "rms", "peak"] = "value"
    range: tuple[float | str, float | str]  # certified range, in `unit` or with units
    default: float | str | None = None  # value where loads.csv has no such column at all, in `unit` or with a unit
    factor: float = 1.0  # logged values are multiplied by it on reading: what they say is off by a known factor


class Sensor(Entry):
    part: str | None = None  # or a node or bar
    position: Point | None = None  # at axis positions zero; the nearest point of the part's surface or volume
    environment: str | None = None  # a sensor in the air


class Instance(Entry):
    """A template's entries under names of their own, at a place of their own (`twin.machine.instances`)."""

    of: str  # template
    origin: Point = (0.0, 0.0, 0.0)  # of the template's coordinates in the machine
    x: Vector = (1.0, 0.0, 0.0)  # direction of the template's x in the machine
    z: Vector | None = None  # of its z, made square to x; by default as upright as can be


class Support(Entry):
    """Ground springs of a surface, shared over its area; N/m along machine x, y, z."""

    surface: str
    stiffness: tuple[Stiffness, Stiffness, Stiffness]


class Limits(Entry):
    """Above these errors, in a case of the stated size, `twin verify` fails.

    At given films the model is linear in its loads, so an error goes with the size of the changes it belongs to.
    """

    temperature: TemperatureDifference = Field(0.02, gt=0)
    at_temperature_range: TemperatureDifference = Field(10.0, gt=0)  # largest change of any sensor in the case
    displacement: Length = Field(0.2e-6, gt=0)
    at_displacement_range: Length = Field(38e-6, gt=0)  # largest change of the TCP error at any pose
    relative: float = Field(0.01, gt=0)  # of every output's own range over all scenarios


class ParameterEntry(Entry):
    """What measurements may correct, and how well it is known; a later table wins over an earlier one.

    Bounds and tolerances have the unit of the parameter, but the tolerance of a positive scale parameter is relative.
    """

    path: str  # dotted path of parameters; *, ? and [abc] as in file names: "sources.*.gain"
    tolerance: float | str | None = None  # one standard deviation: "30 %" or 0.3; "0.5 K" of an offset
    low: float | str | None = None
    high: float | str | None = None
    fixed: bool = False  # never fitted


class MachineEntry(Entry):
    name: str
    description: str = ""
    reference_temperature: Temperature = 20.0
    vertical: Literal["x", "y", "z"] = "z"  # the machine coordinate that points up; pictures are drawn so


class Machine(Entry):
    """A machine of parts with meshes, perhaps with nodes beside them, or a lumped machine: nodes and bars, no mesh."""

    machine: MachineEntry
    materials: dict[str, Material] = {}
    parts: dict[str, Part] = {}
    nodes: dict[str, Node] = {}
    bars: dict[str, Bar] = {}
    axes: dict[str, Axis] = {}
    contacts: dict[str, Contact] = {}
    tanks: dict[str, Tank] = {}
    scales: dict[str, Scale] = {}
    signals: dict[str, SignalEntry] = {}
    environment: dict[str, Environment]
    sources: dict[str, Source] = {}
    films: dict[str, Film]
    sensors: dict[str, Sensor] = {}
    struts: dict[str, Strut] = {}
    tcp: Tcp = Tcp()
    supports: dict[str, Support] = {}
    poses: dict[str, int | tuple[Length, ...]] = {}  # per linear axis: number of equidistant positions, or a list
    limits: Limits = Limits()
    parameters: tuple[ParameterEntry, ...] = ()
    folder: Path = Path(".")  # where machine.toml lies; set by the loader

    @property
    def lumped(self) -> bool:
        """Whether it consists of nodes and bars alone."""
        return bool(self.nodes or self.bars) and not self.parts

    @property
    def has_tcp(self) -> bool:
        """Whether a TCP is described; one that is described wrongly (None) is, too."""
        return self.tcp is None or bool(self.tcp.model_fields_set)

    @property
    def members(self) -> tuple[str, ...]:
        """Names of the parts, or of the nodes and bars: what contacts join to bodies. Nodes beside parts are none."""
        return tuple(self.parts) or (*self.nodes, *self.bars)
