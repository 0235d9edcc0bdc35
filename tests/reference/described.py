"""Pieces of a machine.toml, as text."""

from __future__ import annotations

Triple = tuple[float, float, float]


def head(name: str, reference: float = 0.0) -> str:
    return f'[machine]\nname = "{name}"\nreference_temperature = {reference}\n'


def material(
    name: str, conductivity: float, density: float, heat_capacity: float, elastic: Triple = (200e9, 0.3, 1e-5)
) -> str:
    """elastic: Young's modulus [Pa], Poisson's ratio, expansion [1/K]."""
    return (
        f"[materials.{name}]\nconductivity = {conductivity}\ndensity = {density}\nheat_capacity = {heat_capacity}\n"
        f"youngs_modulus = {elastic[0]}\npoisson_ratio = {elastic[1]}\nexpansion = {elastic[2]}\n"
    )


def box(
    name: str, of: str, size: Triple, divisions: tuple[int, int, int], adiabatic: str, origin: Triple = (0.0, 0.0, 0.0)
) -> str:
    """adiabatic: names of surfaces, separated by blanks."""
    return (
        f'[parts.{name}]\nmaterial = "{of}"\nadiabatic = {adiabatic.split()}\n'
        f"box = {{ origin = {list(origin)}, size = {list(size)}, divisions = {list(divisions)} }}\n"
    )


def constant_air(name: str, temperature: float) -> str:
    return f"[environment.{name}]\ntemperature = {temperature}\n"


def measured_air(name: str, low: float, high: float) -> str:
    """An environment whose temperature is the signal and column `name` [degC]."""
    return f'[signals.{name}]\nunit = "degC"\nrange = [{low}, {high}]\n[environment.{name}]\nsignal = "{name}"\n'


def film(name: str, coefficient: float, surfaces: str, environment: str) -> str:
    """Convection alone with a constant coefficient [W/(m^2 K)]; surfaces separated by blanks."""
    return (
        f'[films.{name}]\nlaw = "constant_film"\nemissivity = 0.0\nsurfaces = {surfaces.split()}\n'
        f'environment = "{environment}"\nparameters = {{ natural = {coefficient} }}\n'
    )


def joint(name: str, a: str, b: str, conductance: float) -> str:
    """A fixed contact of two surfaces with a conductance [W/(m^2 K)]."""
    return f'[contacts.{name}]\nkind = "fixed"\nsurfaces = ["{a}", "{b}"]\nconductance = {conductance}\n'


def switched_source(name: str, power: float, surface: str) -> str:
    """Heat [W] into a surface, times the signal of its name (0 .. 1)."""
    return (
        f'[signals.{name}]\nunit = "1"\nrange = [0.0, 1.0]\n'
        f'[sources.{name}]\nlaw = "switched_heat"\nsurface = "{surface}"\nparameters = {{ power = {power} }}\n'
        f'signals = {{ switch = "{name}" }}\n'
    )


def sensor(name: str, part: str, position: Triple) -> str:
    return f'[sensors.{name}]\npart = "{part}"\nposition = {list(position)}\n'


def displaced(tool: str, point: Triple, work: str) -> str:
    """What the TCP displacement is between."""
    return f'[tcp.tool]\nsurface = "{tool}"\npoint = {list(point)}\n[tcp.work]\nsurface = "{work}"\n'


def held(part: str, first: str = "x_min", second: str = "z_min", third: str = "y_max") -> str:
    """A box free to deform: springs at the means of three of its surfaces, in six directions that fix it just so."""
    k = 1e8  # N/m, loaded by nothing
    rows = ((first, [k, k, k]), (second, [k, k, 0.0]), (third, [0.0, 0.0, k]))
    return "".join(f'[supports.{s}]\nsurface = "{part}.{s}"\nstiffness = {spring}\n' for s, spring in rows)
