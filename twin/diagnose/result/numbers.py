"""Numbers as engineers read them: customary units, as many decimals as an interval has sense for."""

from __future__ import annotations

import math

import numpy as np

# SI unit without blanks and dots -> factor, customary unit
_CUSTOMARY: dict[str, tuple[float, str]] = {
    "m": (1e6, "µm"),
    "s": (1 / 60, "min"),
    "K/s": (86400.0, "K/day"),
    "1/s": (60.0, "1/min"),
    "m/K": (1e6, "µm/K"),
    "J/K": (1e-3, "kJ/K"),
    "degC": (1.0, "°C"),
    "rad": (1e6, "µrad"),
    "1": (1.0, ""),
    "": (1.0, ""),
    "W/m^2/K": (1.0, "W/(m²·K)"),
    "W/m^2K": (1.0, "W/(m²·K)"),
}
_DRIFT = 1e-5  # m/s: slower than this is a drift, in µm/h; faster an axis, in m/min
_EXPANSION = 1e-3  # 1/K: no solid expands by more (rubber by a fifth of it); more is a coefficient of a law


def customary(unit: str, size: float = math.nan) -> tuple[float, str]:
    """Factor from SI and the unit engineers use. `size` (SI) tells a drift in m/s from a speed, and expansion from what
    else is per kelvin."""
    plain = unit.replace(" K", "*K").replace(" ", "").replace("·", "*").replace("²", "^2")
    if plain == "m/s":
        return (60.0, "m/min") if abs(size) >= _DRIFT else (3.6e9, "µm/h")
    if plain == "1/K":
        return (100.0, "%/K") if abs(size) >= _EXPANSION else (1e6, "µm/(m·K)")
    if plain in _CUSTOMARY:
        return _CUSTOMARY[plain]
    return 1.0, plain.replace("*", "·").replace("^2", "²").replace("^3", "³")


def number(value: float, decimals: int | None = None) -> str:
    """`value` to three digits, or to so many decimals (negative ones round to tens)."""
    if not math.isfinite(value):
        return "?" if math.isnan(value) else "-∞" if value < 0 else "∞"
    if decimals is None:
        decimals = 2 - math.floor(math.log10(abs(value))) if value else 0
    decimals = min(decimals, 9)
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return text.removeprefix("-") if float(text) == 0 else text


def quantity(value: float, unit: str) -> str:
    """An SI value in its customary unit: 1.2e-5 m is "12.0 µm"."""
    factor, name = customary(unit, value)
    return f"{number(factor * value)} {name}".rstrip()


def interval_and_unit(value: float, low: float, high: float, unit: str) -> tuple[str, str, str, str]:
    """Value, low and high end (SI) with as many decimals as the interval has sense for, and the customary unit."""
    largest = max((abs(v) for v in (value, low, high) if math.isfinite(v)), default=math.nan)
    factor, name = customary(unit, largest)
    half = factor * (high - low) / 2
    decimals = None
    if math.isfinite(half) and half > 0:
        decimals = min(1 - math.floor(math.log10(half)), 5 - math.floor(math.log10(factor * largest)))
    return number(factor * value, decimals), number(factor * low, decimals), number(factor * high, decimals), name


def size_words(value: float, ci95: tuple[float, float], unit: str) -> str:
    """As "85.0 W (95 % interval 80.2 to 89.8 W)"; "" where there is no size, as of sensors that were swapped."""
    if not math.isfinite(value):
        return ""
    middle, low, high, name = interval_and_unit(value, *ci95, unit)
    name = f" {name}" if name else ""
    if not any(math.isfinite(v) for v in ci95):
        return f"{middle}{name}"
    return f"{middle}{name} (95 % interval {low} to {high}{name})"


def rms(values: np.ndarray, axis: int = 0) -> np.ndarray:
    """Root mean square along an axis of what is finite; NaN where nothing is."""
    values = np.asarray(values, dtype=float)
    there = np.isfinite(values)
    squares = np.where(there, values, 0.0) ** 2
    count = there.sum(axis=axis)
    return np.where(count > 0, np.sqrt(squares.sum(axis=axis) / np.maximum(count, 1)), np.nan)
