"""All outputs of a certificate with what their errors come from: one table, sensors in K, the TCP in um."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

_NAME, _COLUMN = 26, 12  # characters


def table(figures: Mapping[str, Any]) -> list[str]:
    """Lines: per sensor and TCP component the parts of its error in the case, those that count and their sum first.

    Then what does not count (the mesh), and error and range as drawn. Of the TCP, where anything moves it, the worst
    pose or position of each figure, so that a sum may be less than its parts. Artefacts of before 0.7 have no parts.
    """
    parts = sorted(figures.get("parts", ()), key=lambda part: not part["counts"])
    counted = [part["name"] for part in parts if part["counts"]]
    beside = [part["name"] for part in parts if not part["counts"]]
    heads = [*counted, "together", *beside, "as drawn", "range"]
    lines = [f"    {'in the case, from':<{_NAME}}{''.join(f'{head:>{_COLUMN}}' for head in heads)}"]
    columns = [np.asarray(figures[name]) for name in ("temperature_error_in_case", "temperature_error")]
    span = np.asarray(figures["temperature_range"])
    for j, sensor in enumerate(figures["sensors"]):
        own = [np.asarray(part["temperature_error_in_case"])[j] for part in parts]
        lines.append(_line(f"{sensor} [K]", [*_around(own, columns[0][j], len(counted)), columns[1][j], span[j]], 4))
    together = _components(figures, "displacement_error_in_case", "displacement_error_at_positions_in_case")
    drawn = _components(figures, "displacement_error", "displacement_error_at_positions")
    moved = _components(figures, "displacement_range")
    for k, component in enumerate("xyz" if moved.any() else ""):
        own = [np.asarray(part["displacement_error_in_case"])[k] for part in parts]
        numbers = [*_around(own, together[k], len(counted)), drawn[k], moved[k]]
        lines.append(_line(f"TCP {component} [um]", [1e6 * number for number in numbers], 3))
    return lines


def _around(own: list[Any], together: Any, counted: int) -> list[Any]:
    """The parts that count, their sum, the others."""
    return [*own[:counted], together, *own[counted:]]


def _components(figures: Mapping[str, Any], *names: str) -> np.ndarray:
    """(3,) m: the largest of the tables (k, 3) by component; tables that an older artefact lacks left out."""
    rows = [np.asarray(figures[name]).reshape(-1, 3) for name in names if name in figures]
    return np.vstack([*rows, np.zeros((1, 3))]).max(axis=0)


def _line(name: str, numbers: list[Any], digits: int) -> str:
    return f"    {name:<{_NAME}}" + "".join(f"{float(number):>{_COLUMN}.{digits}f}" for number in numbers)
