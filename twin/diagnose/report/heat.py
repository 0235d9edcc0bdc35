"""The picture of heat that nothing explains."""

from __future__ import annotations

import numpy as np

from twin.diagnose.report.pictures import EXTENDED, Picture, drawing, short
from twin.diagnose.result.diagnosis import Unknown
from twin.pictures.style import INK


def heat_picture(unknown: Unknown) -> Picture | None:
    """The heat over time with its 95 % band, a panel per run; None without a history."""
    runs = [(name, np.array(h, dtype=float)) for name, h in unknown.history.items() if len(h[0])]
    if not runs:
        return None
    with drawing(11.0, 0.5 + 2.1 * len(runs)) as fig:
        panels = fig.subplots(len(runs), 1, squeeze=False, sharey=True)[:, 0]
        for axes, (name, (time, heat, sigma)) in zip(panels, runs, strict=True):
            hours = time / 3600.0
            axes.fill_between(hours, heat - 1.96 * sigma, heat + 1.96 * sigma, color=EXTENDED, alpha=0.25, lw=0)
            axes.plot(hours, heat, color=EXTENDED)
            axes.axhline(0.0, color=INK, lw=0.6)
            axes.set(title=short(name, 60), ylabel="heat in W")
        panels[-1].set_xlabel("time in h")
    return Picture(
        f"Heat into {unknown.part} that nothing explains",
        "The line is the heat that would make the simulation agree, the band its 95 % interval; where the band leaves "
        "zero, check what the machine did at that time.",
        fig,
    )
