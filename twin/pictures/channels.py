"""Every measured channel beside what a model computes, one small panel each, runs one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twin.atomic import atomic_path
from twin.logs.trace import Trace
from twin.pictures.style import INK, MUTED, RC, figure

COLUMNS = 4
MOST = 40  # panels: channels with something wrong first, then displacements, then those that are met worst
DOTS = 240  # readings that a panel shows at most
COMPUTED, ASIDE = "#0072b2", "#d55e00"
CAPTION = (
    "Dots are measured, lines computed; orange readings are set aside or corrected. Runs follow one another, their "
    "names at the top. Behind a channel's name: rms of what was compared."
)


def channel_figure(traces: Sequence[Trace]) -> Figure:
    """A panel per channel. Call where traces hold something; the caption is CAPTION."""
    groups = shown(traces)
    runs = list(dict.fromkeys(t.run for t in traces))
    starts = _starts(traces, runs)
    rows = -(-len(groups) // COLUMNS)
    with matplotlib.rc_context(RC):
        fig = figure(14.0, 0.6 + 1.7 * rows)
        panels = fig.subplots(rows, min(COLUMNS, len(groups)), squeeze=False, sharex=True).ravel()
        for axes, group in zip(panels, groups, strict=False):
            _panel(axes, group, starts)
        for axes in panels[len(groups) :]:
            axes.set_visible(False)
        fig.suptitle("  |  ".join(runs), fontsize=8)
        fig.supxlabel("hours, one run after the other", fontsize=8)
    return fig


def write_channels(path: Path, traces: Sequence[Trace]) -> None:
    """The figure as a PNG file, whole or not at all; none where there is no channel."""
    if not traces:
        return
    drawn = channel_figure(traces)
    with atomic_path(path) as temporary:
        drawn.savefig(temporary, format="png", dpi=110, metadata={"Software": None})


def shown(traces: Sequence[Trace]) -> list[list[Trace]]:
    """The traces by channel in the order of their panels, MOST at most."""
    groups: dict[str, list[Trace]] = {}
    for t in traces:
        groups.setdefault(t.channel, []).append(t)

    def order(group: list[Trace]) -> tuple[bool, bool, float]:
        return not any(t.wrong for t in group), group[0].unit == "degC", -_rms(group)

    return sorted(groups.values(), key=order)[:MOST]


def _rms(group: Sequence[Trace]) -> float:
    error = np.concatenate([t.used - t.computed for t in group])
    error = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(error**2))) if len(error) else 0.0


def _starts(traces: Sequence[Trace], runs: Sequence[str]) -> dict[str, float]:
    """Hours at which each run begins on the common axis."""
    lengths = {
        run: max((float(t.time[-1]) for t in traces if t.run == run and len(t.time)), default=0.0) for run in runs
    }
    ends = np.cumsum([lengths[run] / 3600.0 for run in runs])
    return dict(zip(runs, [0.0, *ends[:-1]], strict=True))


def _panel(axes: Axes, group: Sequence[Trace], starts: dict[str, float]) -> None:
    scale, unit, size = (1.0, "degC", "K") if group[0].unit == "degC" else (1e6, "um", "um")
    for t in group:
        hours = starts[t.run] + t.time / 3600.0
        every = slice(None, None, max(1, len(hours) * len(group) // DOTS))
        aside = np.where(t.as_logged, np.nan, t.logged)
        axes.plot(hours[every], scale * aside[every], ".", color=ASIDE, ms=2.5)
        axes.plot(hours[every], scale * t.used[every], ".", color=INK, ms=2.5)
        axes.plot(hours, scale * t.computed, color=COMPUTED, lw=1.1)
        if starts[t.run] > 0.0:
            axes.axvline(starts[t.run], color=MUTED, lw=0.7)
    wrong = next((t.wrong for t in group if t.wrong), "")
    title = f"{group[0].channel} [{unit}]  {scale * _rms(group):.2g} {size}"
    axes.set_title(title + (" !" if wrong else ""), fontsize=8, color=ASIDE if wrong else INK)
    axes.tick_params(labelsize=7)
    _limit(axes, scale, group)


def _limit(axes: Axes, scale: float, group: Sequence[Trace]) -> None:
    """A reading at 850 degC must not flatten what is right: readings set aside may leave the panel."""
    kept = scale * np.concatenate([np.concatenate([t.used, t.computed]) for t in group])
    kept = kept[np.isfinite(kept)]
    if len(kept):
        room = 0.5 * max(float(np.ptp(kept)), 1e-6)
        axes.set_ylim(float(kept.min()) - room, float(kept.max()) + room)
