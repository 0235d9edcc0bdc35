"""Offsets of every axis as a sum of functions of one position each: offset_a(P) = sum over b of f_ab(P_b).

What tables of axis errors over axis positions can express: pitch, straightness and squareness, whatever their curves,
but not what two positions do together. On a full grid the least-squares fit is the mean effect of every position.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.export.axis_offsets import Sampled


@dataclass(frozen=True)
class AdditiveTables:
    """One table per axis that is read, with a column for every axis that is moved."""

    axes: tuple[str, ...]
    grid: tuple[np.ndarray, ...]  # m, positions per axis
    columns: tuple[np.ndarray, ...]  # per axis (len(grid), n_axes) m

    def offsets(self, position: np.ndarray) -> np.ndarray:
        """(m, n_axes) [m] at positions (m, n_axes) [m]: linear between the points, held beyond them."""
        total = np.zeros_like(position)
        for p, nodes, table in zip(position.T, self.grid, self.columns, strict=True):
            total += np.stack([np.interp(p, nodes, column) for column in table.T], axis=1)
        return total

    def rounded(self, digits: int) -> AdditiveTables:
        """Values and positions in so many digits of a metre."""
        return AdditiveTables(
            self.axes,
            tuple(np.round(nodes, digits) for nodes in self.grid),
            tuple(np.round(table, digits) for table in self.columns),
        )


def fit_additive(samples: Sampled) -> AdditiveTables:
    """Least squares over the grid; each axis' mean stands in its own table, columns of other axes have mean zero."""
    shape = (*(len(nodes) for nodes in samples.grid), len(samples.axes))
    offset = samples.offset.reshape(shape)
    mean = samples.offset.mean(axis=0)
    columns = []
    for b in range(len(samples.axes)):
        others = tuple(i for i in range(len(samples.axes)) if i != b)
        table = offset.mean(axis=others) - mean
        table[:, b] += mean[b]
        columns.append(table)
    return AdditiveTables(samples.axes, samples.grid, tuple(columns))
