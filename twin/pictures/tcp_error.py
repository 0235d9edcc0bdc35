"""TCP displacement over time, at the poses of the grid and at the actual axis position."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from twin.pictures.style import AXIS_COLOURS, INK, RC, figure


def tcp_figure(
    hours: np.ndarray, actual: np.ndarray, poses: np.ndarray, middle: int, outside: np.ndarray | None = None
) -> Figure:
    """One panel per direction: a band over all poses, a line at the pose `middle`, a thin one at the actual position.

    hours (n,) h; actual (n, 3) m; poses (n, n_poses, 3) m; outside (n,) bool: steps outside the certified box, shaded.
    While an axis moves to and fro the actual position is met wherever it is at the steps' ends.
    """
    with matplotlib.rc_context(RC):
        fig = figure(9.5, 6.6)
        panels = fig.subplots(3, 1, sharex=True)
        for k, (axes, (name, colour)) in enumerate(zip(panels, AXIS_COLOURS.items(), strict=True)):
            values = 1e6 * poses[:, :, k]
            axes.fill_between(hours, values.min(axis=1), values.max(axis=1), color=colour, alpha=0.18, lw=0)
            axes.plot(hours, 1e6 * actual[:, k], color=colour, lw=0.6, alpha=0.6)
            axes.plot(hours, values[:, middle], color=colour)
            axes.axhline(0.0, color=INK, lw=0.6)
            axes.set_ylabel(f"{name} in µm")
            if outside is not None and outside.any():
                axes.fill_between(
                    hours, 0, 1, where=outside, transform=axes.get_xaxis_transform(), color="#8a9099", alpha=0.18, lw=0
                )
            peak = int(np.abs(values).max(axis=1).argmax())
            worst = values[peak, np.abs(values[peak]).argmax()]
            axes.set_title(
                f"largest at any pose: {worst:+.1f} µm after {hours[peak]:.1f} h",
                fontsize=9,
                fontweight="normal",
                loc="right",
            )
        panels[0].set_title("TCP displacement, tool side minus work side")
        shaded = "; grey: outside the certified box" if outside is not None and outside.any() else ""
        panels[-1].set_xlabel(
            f"time in h   (line: middle of the workspace; band: all {poses.shape[1]} poses; "
            f"thin: actual position{shaded})"
        )
        panels[-1].set_xlim(hours[0], hours[-1])
        fig.align_ylabels(panels)
    return fig
