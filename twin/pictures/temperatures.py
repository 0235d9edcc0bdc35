"""Temperatures at the sensors over time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from twin.pictures.style import INK, MARKED, MUTED, RC, figure


def temperature_figure(
    hours: np.ndarray, temperature: np.ndarray, names: Sequence[str], air: Sequence[str] = (), marked: int = 6
) -> Figure:
    """Sensors over time: those that change most in colour and named, the others grey, sensors in air dashed.

    hours (n,) h; temperature (n, n_sensors) degC with columns as `names`; `air` names the sensors in air;
    `marked` is how many sensors of the structure stand out.
    """
    structure = [i for i, name in enumerate(names) if name not in air]
    spread = np.ptp(temperature, axis=0) if len(hours) else np.zeros(len(names))
    loudest = sorted(structure, key=lambda i: -spread[i])[:marked]
    with matplotlib.rc_context(RC):
        fig = figure(9.5, 4.8)
        axes = fig.subplots()
        for i in structure:
            if i not in loudest:
                axes.plot(hours, temperature[:, i], color=MUTED, lw=0.9, zorder=1)
        for colour, i in zip(MARKED, loudest, strict=False):
            axes.plot(
                hours, temperature[:, i], color=colour, zorder=3, label=f"{names[i]}  ({_change(temperature[:, i])})"
            )
        if len(structure) > len(loudest):
            axes.plot([], [], color=MUTED, lw=0.9, label=f"{len(structure) - len(loudest)} more sensors")
        for i, style in zip((i for i, name in enumerate(names) if name in air), cycle(("--", ":", "-."))):
            axes.plot(hours, temperature[:, i], color=INK, lw=1.1, ls=style, zorder=2, label=f"{names[i]}, air")
        axes.set_xlim(hours[0], hours[-1])
        axes.set_xlabel("time in h")
        axes.set_ylabel("temperature in °C")
        axes.set_title("Temperatures at the sensors")
        axes.legend(
            loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, title="largest changes", alignment="left"
        )
    return fig


def _change(temperature: np.ndarray) -> str:
    """The largest departure from the first value."""
    rise = temperature - temperature[0]
    return f"{rise[np.abs(rise).argmax()]:+.1f} K"
