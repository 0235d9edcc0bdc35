"""The machine description (machine.toml) as validated, frozen types; SI inside.

Numbers are SI or strings with a unit ("120 mm", "25 W/(m^2*K)"). Everything physics happens in has a name, and its
dotted path ("contacts.x_guide.conductance") is that parameter's name in artefacts, fits and reports.
All part meshes are in machine coordinates [m] with every axis at position zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import core_schema

from twin.units import to_si

BOX_SURFACES = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


@dataclass(frozen=True)
class _Quantity:
    """Turn '120 mm' (or a bare SI number) into SI and check the dimension; editors learn that both may be written."""

    unit: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_before_validator_function(lambda v: to_si(v, self.unit), handler(source))

    def __get_pydantic_json_schema__(
        self, core: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"type": ["number", "string"], "description": f"SI number or a string with a unit of {self.unit}"}


Length = Annotated[float, _Quantity("m")]
Temperature = Annotated[float, _Quantity("degC")]  # a point on the scale, degC
TemperatureDifference = Annotated[float, _Quantity("K")]
Conductivity = Annotated[float, _Quantity("W/(m*K)")]
Density = Annotated[float, _Quantity("kg/m^3")]
HeatCapacity = Annotated[float, _Quantity("J/(kg*K)")]
Pressure = Annotated[float, _Quantity("Pa")]
Expansion = Annotated[float, _Quantity("1/K")]
FilmCoefficient = Annotated[float, _Quantity("W/(m^2*K)")]
Stiffness = Annotated[float, _Quantity("N/m")]
Vector = tuple[float, float, float]
Point = tuple[Length, Length, Length]


class Entry(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Material(Entry):
    conductivity: Conductivity = Field(gt=0)
    density: Density = Field(gt=0)
    heat_capacity: HeatCapacity = Field(gt=0)
    youngs_modulus: Pressure = Field(gt=0)
    poisson_ratio: float = Field(gt=-1, lt=0.5)
    expansion: Expansion


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


class Axis(Entry):
    kind: Literal["linear", "rotary"] = "linear"
    direction: Vector
    stroke: tuple[Length, Length] = (0.0, 0.0)  # rotary axes carry no stroke: structure is evaluated at angle zero
    carries: tuple[str, ...]  # parts that move with the axis (their whole bodies do)
    position: str  # signal


class StiffnessOfPair(Entry):
    """Per pair, along: the axis, the pad's surface normal, and normal x axis. Zero means free."""

    axial: Stiffness = Field(0.0, ge=0)
    normal: Stiffness = Field(0.0, ge=0)
    lateral: Stiffness = Field(0.0, ge=0)


class Contact(Entry):
    """fixed: two surfaces glued, meshes need not match. moving: pads (carriages, nuts) on rails or screws."""

    kind: Literal["fixed", "moving"]
    surfaces: tuple[str, str] | None = None  # fixed: "part.surface" twice
    axis: str | None = None  # moving
    pairs: tuple[tuple[str, str], ...] = ()  # moving: (rail "part.surface", pad "part.surface")
    segments: int = Field(12, ge=2)  # moving: stations along each rail
    conductance: FilmCoefficient = Field(gt=0)  # of the joint, or per pad area
    stiffness: StiffnessOfPair = StiffnessOfPair()  # moving; fixed joints are glued


class Source(Entry):
    law: str
    surface: str | None = None  # "part.surface"
    contact: str | None = None  # a moving contact: heat goes to its rails (by dwell time) and pads
    rail_share: float = Field(0.5, ge=0, le=1)
    gain: float = Field(1.0, ge=0)
    parameters: dict[str, float | str] = {}
    signals: dict[str, str] = {}


class Film(Entry):
    law: str
    surfaces: tuple[str, ...]  # "part.surface", or "part.*" for every surface of the part not used elsewhere
    environment: str
    parameters: dict[str, float | str] = {}
    signals: dict[str, str] = {}


class Environment(Entry):
    signal: str | None = None
    temperature: Temperature | None = None  # constant, where no signal is given


class SignalEntry(Entry):
    column: str | None = None  # header in loads.csv, the signal's own name by default
    unit: str
    kind: Literal["value", "rms", "peak"] = "value"
    range: tuple[float | str, float | str]  # certified range, in `unit` or with units


class Sensor(Entry):
    part: str | None = None
    position: Point | None = None  # at axis positions zero; the nearest point of the part's surface or volume
    environment: str | None = None  # a sensor in the air


class TcpSide(Entry):
    """The patch whose mean displacement and tilt carry the point (paper 000, Fig. 6)."""

    surface: str  # "part.surface"
    point: Point | None = None  # tool side only: the tool centre point at axis positions zero


class Tcp(Entry):
    tool: TcpSide
    work: TcpSide


class Support(Entry):
    """Ground springs of a surface, shared over its area; N/m along machine x, y, z."""

    surface: str
    stiffness: tuple[Stiffness, Stiffness, Stiffness]


class Limits(Entry):
    """Above these errors, in a case of the stated size, `twin verify` fails.

    The model is linear in its loads, so an error goes with the size of the temperature and TCP changes it belongs to.
    """

    temperature: TemperatureDifference = Field(0.02, gt=0)
    at_temperature_range: TemperatureDifference = Field(10.0, gt=0)  # largest change of any sensor in the case
    displacement: Length = Field(0.2e-6, gt=0)
    at_displacement_range: Length = Field(38e-6, gt=0)  # largest change of the TCP error at any pose
    relative: float = Field(0.01, gt=0)  # of every output's own range over all scenarios


class MachineEntry(Entry):
    name: str
    description: str = ""
    reference_temperature: Temperature = 20.0
    vertical: Literal["x", "y", "z"] = "z"  # the machine coordinate that points up; pictures are drawn so


class Machine(Entry):
    machine: MachineEntry
    materials: dict[str, Material]
    parts: dict[str, Part]
    axes: dict[str, Axis] = {}
    contacts: dict[str, Contact] = {}
    signals: dict[str, SignalEntry] = {}
    environment: dict[str, Environment]
    sources: dict[str, Source] = {}
    films: dict[str, Film]
    sensors: dict[str, Sensor] = {}
    tcp: Tcp
    supports: dict[str, Support]
    poses: dict[str, int | tuple[Length, ...]] = {}  # per linear axis: number of equidistant positions, or a list
    limits: Limits = Limits()
    folder: Path = Path(".")  # where machine.toml lies; set by the loader
