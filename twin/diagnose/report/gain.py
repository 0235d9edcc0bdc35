"""Pictures of what was measured beside the models: gain on the sealed run, every channel, unexplained heat."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np

from twin.diagnose.report.pictures import DELIVERED, EXTENDED, PAGE_RC, STAGES, Picture, drawing, short, without
from twin.diagnose.report.residuals import loudest
from twin.diagnose.result.diagnosis import Diagnosis, Gain, Series
from twin.pictures.channels import CAPTION, channel_figure
from twin.pictures.style import INK

CHANNELS = 30


def gain_picture(d: Diagnosis, run: str) -> Picture | None:
    """Root mean square per channel of a sealed run at the three stages, temperatures and TCP beside each other."""
    own = [g for g in d.gain if g.run == run]
    groups = [
        (label, scale, _largest([g for g in own if g.unit == unit]))
        for unit, scale, label in (("K", 1.0, "K"), ("m", 1e6, "µm"))
    ]
    groups = [group for group in groups if group[2]]
    if not groups:
        return None
    rows = max(len(gains) for _, _, gains in groups)
    with drawing(1.4 + 0.22 * rows) as fig:
        panels = fig.subplots(1, len(groups), squeeze=False)[0]
        for axes, (label, scale, gains) in zip(panels, groups, strict=True):
            y = np.arange(len(gains))
            stages = [
                np.array([getattr(g, k) for g in gains]) * scale for k in ("delivered", "recalibrated", "extended")
            ]
            axes.hlines(y, np.fmin.reduce(stages), np.fmax.reduce(stages), color=DELIVERED, lw=1.0)
            for (stage, colour), values, marker in zip(STAGES, stages, "sov", strict=True):
                axes.plot(values, y, marker, color=colour, ms=5.5, label=stage if axes is panels[0] else None)
            axes.set_yticks(y, [short(g.channel) + (" *" if g.affected else "") for g in gains], fontsize=8)
            axes.set_ylim(rows - 0.5, -0.5)
            axes.set_xlim(left=0.0)
            axes.set_xlabel(f"root mean square of measured - simulated in {label}")
        fig.legend(loc="outside upper center", ncols=3)
    left_out = len(own) - sum(len(gains) for _, _, gains in groups)
    return Picture(
        f"Gain per channel on the sealed run {run}",
        "What each model leaves of a channel, noise included, further left is better; * marks the channels that the "
        "causes move" + without(left_out, "quieter channels"),
        fig,
    )


def _largest(gains: Sequence[Gain]) -> list[Gain]:
    these = [g for g in gains if all(math.isfinite(v) for v in (g.delivered, g.recalibrated, g.extended))]
    return sorted(these, key=lambda g: (not g.affected, -g.delivered))[:CHANNELS]


@dataclass(frozen=True)
class _Channel:
    name: str
    label: str
    hours: np.ndarray
    measured: np.ndarray | None
    residuals: tuple[np.ndarray, np.ndarray, np.ndarray]


def _channels(s: Series, d: Diagnosis, sensors: int = 4) -> list[_Channel]:
    own = [g for g in d.gain if g.run == s.run]
    better = {g.channel: g.delivered - g.extended for g in own if math.isfinite(g.delivered - g.extended)}
    order = sorted(range(len(s.sensors)), key=lambda i: -better.get(s.sensors[i], -math.inf)) if better else loudest(s)
    result = [
        _Channel(
            short(s.sensors[i]), "°C" if s.measured is not None else "residual in K", np.asarray(s.time) / 3600.0,
            None if s.measured is None else np.asarray(s.measured)[:, i],
            (s.delivered[:, i], s.recalibrated[:, i], s.extended[:, i]),
        )
        for i in order[:sensors]
        if len(s.time)
    ]  # fmt: skip
    if len(s.tcp_time):
        label = "µm" if s.tcp_measured is not None else "residual in µm"
        result += [
            _Channel(
                f"TCP {name}", label, np.asarray(s.tcp_time) / 3600.0,
                None if s.tcp_measured is None else 1e6 * np.asarray(s.tcp_measured)[:, k],
                (1e6 * s.tcp_delivered[:, k], 1e6 * s.tcp_recalibrated[:, k], 1e6 * s.tcp_extended[:, k]),
            )
            for k, name in enumerate("xyz")
        ]  # fmt: skip
    return [c for c in result if any(np.isfinite(r).any() for r in c.residuals)]


def broken(hours: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A line that does not bridge missing bins: NaN where the time jumps by more than 2.5 usual steps."""
    steps = np.diff(hours)
    gaps = np.flatnonzero(steps > 2.5 * np.median(steps)) + 1 if len(steps) else np.zeros(0, dtype=int)
    return np.insert(hours, gaps, np.nan), np.insert(np.asarray(values, dtype=float), gaps, np.nan)


def overlay_picture(d: Diagnosis, s: Series) -> Picture | None:
    """Measured and simulated on a sealed run: sensors that gain most, the TCP; residuals where that is all."""
    channels = _channels(s, d)
    if not channels:
        return None
    columns = 2 if len(channels) > 1 else 1
    rows = -(-len(channels) // columns)
    with drawing(0.6 + 2.0 * rows) as fig:
        panels = fig.subplots(rows, columns, squeeze=False).ravel()
        for axes, channel in zip(panels, channels, strict=False):
            for (stage, colour), residual, style in zip(STAGES, channel.residuals, ("-", "--", "-"), strict=True):
                values = residual if channel.measured is None else channel.measured - residual
                axes.plot(*broken(channel.hours, values), style, color=colour, lw=1.3, label=stage)
            if channel.measured is not None:
                every = max(1, len(channel.hours) // 150)
                axes.plot(channel.hours[::every], channel.measured[::every], ".", color=INK, ms=3.5, label="measured")
            axes.set_title(channel.name)
            axes.set_ylabel(channel.label)
            axes.set_xlabel("time in h")
        for axes in panels[len(channels) :]:
            axes.set_visible(False)
        fig.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    drawn, goal = ("Lines are residuals", "zero")
    if channels[0].measured is not None:
        drawn, goal = ("Dots are measured, lines simulated", "the dots")
    return Picture(
        f"{s.run}: measured and simulated",
        f"{drawn}; no value was fitted to this run, so an extended line that lies nearer to {goal} than the others has "
        "learnt something of the machine rather than of the data.",
        fig,
    )


def channels_picture(d: Diagnosis) -> Picture | None:
    """Every measured channel beside the extended model, a panel each; sealed runs come last."""
    if not d.traces:
        return None
    with matplotlib.rc_context(PAGE_RC):
        return Picture("Channels: measured and computed", CAPTION, channel_figure(d.traces))


def unknown_picture(d: Diagnosis) -> Picture | None:
    """The unexplained heat over time with its 95 % band, a panel per run."""
    if d.unknown is None:
        return None
    runs = [(name, np.array(h, dtype=float)) for name, h in d.unknown.history.items() if len(h[0])]
    if not runs:
        return None
    with drawing(0.5 + 2.1 * len(runs)) as fig:
        panels = fig.subplots(len(runs), 1, squeeze=False, sharey=True)[:, 0]
        for axes, (name, (time, heat, sigma)) in zip(panels, runs, strict=True):
            hours = time / 3600.0
            axes.fill_between(hours, heat - 1.96 * sigma, heat + 1.96 * sigma, color=EXTENDED, alpha=0.25, lw=0)
            axes.plot(hours, heat, color=EXTENDED)
            axes.axhline(0.0, color=INK, lw=0.6)
            axes.set_title(short(name, 60))
            axes.set_ylabel("heat in W")
        panels[-1].set_xlabel("time in h")
    return Picture(
        f"Heat into {d.unknown.part} that nothing explains",
        "The line is the heat that would make the simulation agree, the band its 95 % interval; where the band leaves "
        "zero, look what the machine did at that time.",
        fig,
    )
