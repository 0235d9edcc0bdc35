"""What turns a load log into heat, film coefficients and contact positions: names, laws, parameters, wiring.

It travels inside the artefact as JSON, so the runtime needs no machine description.
All values SI, temperatures degC (differences K).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from twin.rom.from_json import filled


@dataclass(frozen=True)
class Signal:
    """A logged load channel."""

    name: str  # "x_current"
    column: str  # header in loads.csv without the unit
    unit: str  # unit after conversion: SI ("m", "m/s", "A", "degC", "1/s", "1")
    kind: str  # "value", "rms" or "peak" (peak is converted to rms on reading)
    low: float  # certified range
    high: float
    default: float | None = None  # SI, rms; where a log has no such column. None: the log must have it
    factor: float = 1.0  # of logged values, before peaks are turned into rms


@dataclass(frozen=True)
class AxisWiring:
    """A linear axis: which signal is its position and what it carries."""

    name: str
    direction: tuple[float, float, float]
    low: float  # m, stroke
    high: float
    position: str  # signal name


@dataclass(frozen=True)
class RotaryWiring:
    """A rotary axis that turns the tool or the work: which signal is its angle."""

    name: str
    position: str  # signal name, rad


@dataclass(frozen=True)
class EnvironmentWiring:
    """Air of a zone, a radiant surrounding, or a coolant at its inlet."""

    name: str
    signal: str  # "" where the temperature is constant
    temperature: float  # degC, where no signal is given
    gradient: float = 0.0  # K/m upwards from `height`
    height: float = 0.0  # m, vertical machine coordinate
    offset: float = 0.0  # K: what surrounds the machine is warmer by this than `signal` or `temperature` says
    switch: str = ""  # signal 0 .. 1
    switched_offset: float = 0.0  # K: another offset, times the switch


@dataclass(frozen=True)
class LawUse:
    """A law of `twin.physics.laws.LAWS` with its parameters and the signals it reads.

    Arguments of the law that the model fills in (`Law.states`) may be wired to a signal instead.
    """

    law: str
    parameters: dict[str, float]
    signals: dict[str, str]  # argument of the law -> signal name


@dataclass(frozen=True)
class Source:
    """Heat into a surface, or into a moving contact (shared by rail segments, by dwell time, and pads)."""

    name: str
    use: LawUse
    gain: float  # calibration factor, 1 by default
    contact: str  # "" for a surface source, else a contact name
    rail_share: float  # part of a contact source that goes into the rail or screw


@dataclass(frozen=True)
class Film:
    """The film coefficient [W/(m^2 K)] of a group of surfaces: convection to an environment, and radiation."""

    name: str
    use: LawUse
    environment: int
    low: float  # W/(m^2 K), certified range, radiation included
    high: float
    gain: float = 1.0  # calibration factor of the convection
    emissivity: float = 0.0  # 0: no radiation
    radiant: int = 0  # environment at the radiant temperature
    additional: bool = False  # on surfaces that have their film, or none, without it


@dataclass(frozen=True)
class Joint:
    """The conductance [W/(m^2 K)] of a fixed contact inside a body: a parameter, an affine term."""

    name: str
    conductance: float
    low: float
    high: float
    key: str = "conductance"  # in the description; of lumped machines also "total", which is in W/K
    switch: str = ""  # signal 0 .. 1; "": none
    switched: float = 1.0  # factor of the conductance where the switch is 1


@dataclass(frozen=True)
class Rail:
    """A rail or screw: ports along an axis. `stations` are the centroids of its segments at axis position zero."""

    name: str
    first_port: int
    stations: tuple[float, ...]  # m, increasing, along the axis direction


@dataclass(frozen=True)
class Pair:
    """A pad (carriage or nut) on a rail."""

    contact: str  # "x_guide"
    axis: int
    rail: int
    pad_port: int
    station: float  # m: coordinate of the pad along the axis at axis position zero
    rail_moves: bool  # True where the rail is on the carried body: the pad then sits at station - position
    area: float  # m^2 of the pad
    conductance: float  # W/(m^2 K)
    assignment: str = "interpolated"  # heat and conductance, or "segment": to the one below the pad
    key: str = "conductance"  # as of joints; a total belongs to an area of 1 m^2
    switch: str = ""  # as of joints
    switched: float = 1.0


@dataclass(frozen=True)
class LoadModel:
    signals: tuple[Signal, ...]
    axes: tuple[AxisWiring, ...]
    environments: tuple[EnvironmentWiring, ...]
    sources: tuple[Source, ...]
    films: tuple[Film, ...]
    joints: tuple[Joint, ...]
    ports: tuple[str, ...]
    rails: tuple[Rail, ...]
    pairs: tuple[Pair, ...]
    rotary: tuple[RotaryWiring, ...] = ()  # in the order of the angles behind positions (`twin.rom.tcp`)

    @property
    def surroundings(self) -> int:
        """The environment a machine at rest is as warm as: the first whose films radiate, hence no coolant."""
        films = [f for f in self.films if f.emissivity > 0.0] or [f for f in self.films if not f.additional]
        return min((f.environment for f in films), default=0)

    @property
    def contacts(self) -> tuple[str, ...]:
        """Moving contacts in the order of their first pair."""
        return tuple(dict.fromkeys(p.contact for p in self.pairs))

    @property
    def contact_sources(self) -> tuple[int, ...]:
        """Index of the sources whose heat goes into moving contacts."""
        return tuple(j for j, s in enumerate(self.sources) if s.contact)

    @property
    def theta_names(self) -> tuple[str, ...]:
        """Coefficients of the affine terms: films first, then joints."""
        return tuple(f"films.{f.name}" for f in self.films) + tuple(f"contacts.{j.name}.{j.key}" for j in self.joints)

    def to_json(self) -> dict:
        return asdict(self)

    @classmethod
    def from_json(cls, d: Any) -> LoadModel:
        """The inverse of `to_json`. Raises TypeError and ValueError as `twin.rom.from_json.filled`."""
        return filled(cls, d, "load_model")
