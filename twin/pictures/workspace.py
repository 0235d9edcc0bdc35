"""The workspace, distorted by the TCP displacement at the poses of the grid."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from twin.pictures.style import DISPLACEMENT_MAP, RC, figure


def exaggeration(poses: np.ndarray, displacement: np.ndarray, share: float = 0.15) -> float:
    """A round factor that draws the largest displacement as about `share` of the workspace's largest extent."""
    largest = float(np.linalg.norm(displacement, axis=-1).max())
    extent = float(np.ptp(poses, axis=0).max())
    if not (largest > 0 and extent > 0):
        return 1.0
    factor = share * extent / largest
    step = 10.0 ** np.floor(np.log10(factor))
    return float(step * max(s for s in (1, 2, 5) if s * step <= factor))


def shares(poses: np.ndarray, displacement: np.ndarray) -> tuple[float, float, float]:
    """Shift, linear and higher-order part of the volumetric error [m], rms over the poses (paper 000, 0.28).

    poses (n_poses, n_axes) m, displacement (n_poses, 3) m. The linear part is the least-squares fit in the positions.
    """
    shift = displacement.mean(axis=0)
    rest = displacement - shift
    centred = poses - poses.mean(axis=0)
    slope, *_ = np.linalg.lstsq(centred, rest, rcond=None)
    linear = centred @ slope

    def rms(part: np.ndarray) -> float:
        return float(np.sqrt((part**2).sum(axis=-1).mean()))

    return float(np.linalg.norm(shift)), rms(linear), rms(rest - linear)


def outer_lines(shape: Sequence[int]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Indices of the poses (C order over `shape`) along every grid line on the faces of the grid, and along its edges.

    An inner line would only hide what the outer ones show. A line on an edge is in both lists.
    """
    index = np.arange(int(np.prod(shape))).reshape(shape)
    faces, edges = [], []
    for axis, count in enumerate(shape):
        if count == 1:
            continue
        others = [k for k in range(len(shape)) if k != axis]
        for place in product(*(range(shape[k]) for k in others)):
            at_border = sum(i in (0, shape[k] - 1) for i, k in zip(place, others, strict=True))
            line = index[tuple(slice(None) if k == axis else place[others.index(k)] for k in range(len(shape)))]
            if at_border >= len(others) - 1:
                faces.append(line)
            if at_border == len(others):
                edges.append(line)
    return faces, edges


def workspace_figure(
    nominal: np.ndarray, displacement: np.ndarray, shape: Sequence[int], title: str, vertical: int = 2
) -> Figure:
    """The grid of poses as it stands (grey) and displaced (coloured by the length of the displacement), scaled.

    nominal (n_poses, 3) m, the tool point's place relative to position zero, C order over `shape` (positions per
    linear axis); displacement (n_poses, 3) m; `vertical`: the coordinate that points up.
    """
    factor = exaggeration(nominal, displacement)
    moved = nominal + factor * displacement
    length = 1e6 * np.linalg.norm(displacement, axis=1)
    order = [(1, 2, 0), (2, 0, 1), (0, 1, 2)][vertical]  # matplotlib draws its third coordinate upwards
    names = "xyz"
    with matplotlib.rc_context(RC):
        fig = figure(8.2, 6.6)
        axes = fig.add_subplot(projection="3d")
        faces, edges = outer_lines(shape)
        axes.add_collection3d(
            Line3DCollection([1e3 * nominal[i][:, order] for i in edges], colors="#6a7078", lw=1.0, ls=(0, (4, 3)))
        )
        pieces = np.array([pair for line in faces for pair in pairwise(line)])
        drawn = Line3DCollection(1e3 * moved[pieces][:, :, order], cmap=DISPLACEMENT_MAP, lw=1.9)
        drawn.set_array(length[pieces].mean(axis=1))
        drawn.set_clim(0.0, max(length.max(), 1e-3))
        axes.add_collection3d(drawn)
        both = 1e3 * np.vstack([nominal, moved])[:, order]
        low, high = both.min(axis=0), both.max(axis=0)
        size = np.maximum(high - low, 0.3 * (high - low).max())  # a grid of one axis is drawn as a line in a box
        for setter, centre, s in zip(
            (axes.set_xlim, axes.set_ylim, axes.set_zlim), (low + high) / 2, size, strict=True
        ):
            setter(centre - 0.52 * s, centre + 0.52 * s)
        axes.set_box_aspect(size, zoom=0.95)
        for setter, k in zip((axes.set_xlabel, axes.set_ylabel, axes.set_zlabel), order, strict=True):
            setter(f"{names[k]} in mm", labelpad=8)
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.set_pane_color((1, 1, 1, 1))
            axis.set_major_locator(MaxNLocator(4))
        axes.view_init(elev=22, azim=-58)
        bar = fig.colorbar(drawn, ax=axes, shrink=0.6, pad=0.1)
        bar.set_label("length of the TCP displacement in µm")
        bar.outline.set_visible(False)
        shift, linear, rest = (1e6 * s for s in shares(nominal, displacement))
        fig.suptitle(title, x=0.02, ha="left", fontsize=12, fontweight="bold")
        axes.set_title(
            f"dashed: as it stands; coloured: displacements drawn {factor:.0f} times\n"
            f"volumetric error: shift {shift:.1f} µm; rms over the poses: linear {linear:.1f} µm, beyond {rest:.2f} µm",
            fontsize=9, fontweight="normal", loc="left", x=-0.08,
        )  # fmt: skip
    return fig
