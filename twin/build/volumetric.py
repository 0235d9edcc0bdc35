"""The volumetric error: the TCP displacement over the whole workspace, and how much of it is a shift.

Paper 000, section 4, Fig. 13, finds that the error "consists mostly of a shift of the working volume", and asks for an
analysis under several loads before poses are saved: `volumetric_shares` says how much of it is which, and
`twin.build.pose_study` how many poses it takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.build.structure import Structure
from twin.rom.lumped_structure import LumpedStructure


@dataclass(frozen=True)
class Shares:
    """Shares of the sum of squares of a volumetric error; they sum to 1. NaN each where the error is zero."""

    shift: float  # the same vector everywhere
    linear: float  # what a field linear in the positions adds: squareness, pitch, straight scale errors
    higher: float  # the rest


def volumetric_shares(positions: np.ndarray, error: np.ndarray) -> Shares:
    """Shares of shift, linear and higher-order parts by least squares over the poses.

    positions (m, d) [m], error (m, 3) [m]. The constant is fitted first, then constant and linear terms together: the
    spaces are nested, so the fitted sums of squares add up (Pythagoras). Poses should cover the volume evenly: with
    fewer than d + 2 of them in general position nothing remains for the higher orders.
    """
    total = float(np.sum(error**2))
    if total == 0.0:
        return Shares(np.nan, np.nan, np.nan)
    shift = np.broadcast_to(error.mean(axis=0), error.shape)
    centred = positions - positions.mean(axis=0)
    scale = np.maximum(np.abs(centred).max(axis=0, initial=0.0), np.finfo(float).tiny)
    slope, *_ = np.linalg.lstsq(centred / scale, error - shift, rcond=None)
    linear = centred / scale @ slope
    rest = error - shift - linear
    return Shares(*(float(np.sum(part**2)) / total for part in (shift, linear, rest)))


def displacements(
    structure: Structure | LumpedStructure, positions: np.ndarray, fields: Sequence[Sequence[np.ndarray]]
) -> np.ndarray:
    """TCP displacement (n_fields, n_positions, 3) [m] of temperature fields at any positions (n_positions, n_axes) [m].

    fields: per field and body T - T_ref (n_nodes_b,) [K]. A pose costs one small dense system whatever the mesh: the
    fields enter through the port displacements H_b T_b, found once.
    """
    columns = [np.column_stack(body) for body in zip(*fields, strict=True)]  # (n_nodes_b, n_fields)
    ports = columns
    if isinstance(structure, Structure):
        ports = [body.H @ T for body, T in zip(structure.bodies, columns, strict=True)]
    result = np.empty((len(fields), len(positions), 3))
    for i, position in enumerate(positions):
        result[:, i] = sum((z @ w).T for z, w in zip(structure.rows(position), ports, strict=True))
        if isinstance(structure, Structure):
            for b, nodes, growth in structure.system.scale_rows(position):
                result[:, i] += (growth @ columns[b][nodes]).T
    return result


def grid_points(grid: Sequence[np.ndarray]) -> np.ndarray:
    """All positions (n, n_axes) of a grid, in C order."""
    return np.stack([a.ravel() for a in np.meshgrid(*grid, indexing="ij")], axis=1)
