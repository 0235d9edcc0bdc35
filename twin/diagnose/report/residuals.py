"""The residuals of a run as a map: sensors over time at the three stages, under the loads."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.image import AxesImage

from twin.diagnose.report.pictures import LOAD_MAP, RESIDUAL_MAP, Picture, drawing, short
from twin.diagnose.result.diagnosis import Diagnosis, Series
from twin.diagnose.result.numbers import rms

ROWS = 40  # sensors that a picture shows at most, those with the largest residuals
LOADS = 10  # signals in the load strip at most
RUNS = 6  # runs with a map of their own at most, beside the sealed ones
NAMES = 7.5  # points


def loudest(series: Series) -> list[int]:
    """Columns of the ROWS sensors with the largest residuals as delivered, those without a value last."""
    size = np.nan_to_num(rms(series.delivered), nan=-1.0)
    return np.argsort(-size, kind="stable")[:ROWS].tolist()


def drawn_runs(d: Diagnosis) -> list[Series]:
    """The runs that get a map: the RUNS with the largest residuals, and the sealed ones."""
    order = sorted(d.series, key=lambda s: (s.sealed, -float(np.nan_to_num(rms(s.delivered.ravel())))))
    chosen = {s.run for s in order[:RUNS]} | {s.run for s in d.series if s.sealed}
    return [s for s in d.series if s.run in chosen]


def with_gaps(time: np.ndarray, values: np.ndarray) -> tuple[tuple[float, float], np.ndarray]:
    """First and last edge [the unit of time] of a map, and its rows (n, ...), one per usual step: NaN where a bin is
    missing."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    at = np.rint((time - time[0]) / step).astype(int)
    rows = np.full((at[-1] + 1, *values.shape[1:]), np.nan)
    rows[at] = values
    return (float(time[0] - step / 2), float(time[0] + (at[-1] + 0.5) * step)), rows


def load_rows(loads: Mapping[str, np.ndarray]) -> tuple[list[str], np.ndarray]:
    """Names and shares (signals, b) of the signals that vary: 0 to 1 of the largest, or from the least of those that
    are never near zero (temperatures)."""
    names, rows = [], []
    for name, values in loads.items():
        size = np.abs(np.asarray(values, dtype=float))
        there = size[np.isfinite(size)]
        if not there.size or np.ptp(there) <= 1e-9 * max(there.max(), 1e-300):
            continue
        low = there.min() if there.min() > 0.5 * there.max() else 0.0
        names.append(name)
        rows.append((size - low) / (there.max() - low))
    return names[:LOADS], np.array(rows[:LOADS])


def residual_map(series: Series) -> Picture | None:
    """Sensor x time, as delivered, recalibrated and extended, with the loads below the first; None without a bin."""
    if not len(series.time) or not series.sensors:
        return None
    chosen = loudest(series)
    hours = np.asarray(series.time, dtype=float) / 3600.0
    names, loads = load_rows(series.loads)
    stages = {"as delivered": series.delivered, "recalibrated": series.recalibrated, "extended": series.extended}
    shown = {name: np.asarray(values, dtype=float)[:, chosen] for name, values in stages.items()}
    sizes = np.abs(np.concatenate([v.ravel() for v in shown.values()]))
    # the few largest values may exceed the colours
    largest = max(float(np.percentile(sizes[np.isfinite(sizes)], 99.0)), 1e-9) if np.isfinite(sizes).any() else 1.0
    heights = [max(1.6, 0.17 * len(chosen)), *([max(0.35, 0.17 * len(names))] if names else [])]
    with drawing(11.0, sum(heights) + 1.1, grid=False) as fig:
        panels = fig.subplots(len(heights), 3, squeeze=False, sharex=True, sharey="row",
                              gridspec_kw={"height_ratios": heights})  # fmt: skip
        for axes, (stage, values) in zip(panels[0], shown.items(), strict=True):
            image = _map(axes, hours, values, RESIDUAL_MAP, (-largest, largest))
            left = float(rms(values.ravel()))
            axes.set_title(f"{stage}, {left:.2f} K" if np.isfinite(left) else stage)
            axes.tick_params(labelbottom=True)
        _named(panels[0, 0], [series.sensors[i] for i in chosen])
        if names:  # one strip for all stages: their loads are the same
            _map(panels[1, 0], hours, loads.T, LOAD_MAP, (0.0, 1.0))
            _named(panels[1, 0], names)
            for axes in panels[1, 1:]:
                axes.set_axis_off()
        panels[-1, 0].set_xlabel("time in h")
        fig.colorbar(image, ax=panels[0, :].tolist(), label="measured - simulated in K", aspect=15, pad=0.01)
    left_out = len(series.sensors) - len(chosen)
    return Picture(
        f"Residuals of {series.run}" + (" (sealed: no value was fitted to it)" if series.sealed else ""),
        "Orange: the machine is warmer than the simulation, blue: colder, grey: no data; what switches with a "
        "row of the strip at the left (dark: large) follows that load, and a good model leaves a pale map"
        + (f" ({left_out} sensors with smaller residuals are left out)." if left_out else "."),
        fig,
    )


def _map(axes: Axes, hours: np.ndarray, values: np.ndarray, cmap: Colormap, limits: tuple[float, float]) -> AxesImage:
    """Values (b, rows) over time, the first row on top."""
    edges, rows = with_gaps(hours, values)
    return axes.imshow(
        rows.T, cmap=cmap, clim=limits, extent=(*edges, values.shape[1], 0), aspect="auto", interpolation="nearest"
    )


def _named(axes: Axes, names: list[str]) -> None:
    axes.set_yticks(np.arange(len(names)) + 0.5, [short(n) for n in names], fontsize=NAMES)
