"""Quantities of a description: numbers in SI, or strings with a unit of their dimension ("25 W/(m^2*K)").

Each is a float for type checkers; pydantic converts and checks what stands in machine.toml.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import core_schema

from twin.units import machine_temperature, surroundings_temperature, to_si


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
Temperature = Annotated[float, AfterValidator(machine_temperature), _Quantity("degC")]  # a point on the scale, degC
Surroundings = Annotated[float, AfterValidator(surroundings_temperature), _Quantity("degC")]
TemperatureDifference = Annotated[float, _Quantity("K")]
Conductivity = Annotated[float, _Quantity("W/(m*K)")]
Density = Annotated[float, _Quantity("kg/m^3")]
HeatCapacity = Annotated[float, _Quantity("J/(kg*K)")]
Pressure = Annotated[float, _Quantity("Pa")]
Expansion = Annotated[float, _Quantity("1/K")]
FilmCoefficient = Annotated[float, _Quantity("W/(m^2*K)")]
Stiffness = Annotated[float, _Quantity("N/m")]
Speed = Annotated[float, _Quantity("m/s")]
Acceleration = Annotated[float, _Quantity("m/s^2")]
Jerk = Annotated[float, _Quantity("m/s^3")]
TemperatureGradient = Annotated[float, _Quantity("K/m")]
Area = Annotated[float, _Quantity("m^2")]
Volume = Annotated[float, _Quantity("m^3")]
Mass = Annotated[float, _Quantity("kg")]
Capacity = Annotated[float, _Quantity("J/K")]
Conductance = Annotated[float, _Quantity("W/K")]
DisplacementPerKelvin = Annotated[float, _Quantity("m/K")]
Vector = tuple[float, float, float]
Point = tuple[Length, Length, Length]


class Entry(BaseModel):
    """A table of machine.toml: its keys, no others, and no infinite number."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
