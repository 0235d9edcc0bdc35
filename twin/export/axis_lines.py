"""Offset and slope of every axis over its own position: all that a control's temperature compensation knows.

    offset_a(P) = K0_a + tan_beta_a (P_a - P0_a)        least squares over the workspace

It cannot express straightness, squareness or tilt: an offset of one axis that depends on another one's position.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.export.axis_offsets import Sampled


@dataclass(frozen=True)
class AxisLine:
    """The line of one axis."""

    name: str
    constant: float  # m, K0
    slope: float  # 1, tan beta
    reference: float  # m, P0


def fit_lines(samples: Sampled) -> tuple[AxisLine, ...]:
    """One line per axis, P0 in the middle of its range, where rounding the slope does least; level where it has one."""
    lines = []
    for k, name in enumerate(samples.axes):
        middle = (samples.grid[k][0] + samples.grid[k][-1]) / 2
        along, offset = samples.position[:, k] - middle, samples.offset[:, k]
        (constant, slope), *_ = np.linalg.lstsq(np.column_stack([np.ones_like(along), along]), offset, rcond=None)
        lines.append(AxisLine(name, float(constant), float(slope), middle))
    return tuple(lines)


def line_offsets(lines: Sequence[AxisLine], position: np.ndarray) -> np.ndarray:
    """What the lines add (m, n_axes) [m] at positions (m, n_axes) [m]."""
    columns = [a.constant + a.slope * (p - a.reference) for a, p in zip(lines, position.T, strict=True)]
    return np.stack(columns, axis=1)
