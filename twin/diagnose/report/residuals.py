"""Pictures of the residuals: over time under the loads, by load state, and what is left of their correlation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from twin.diagnose.report import pictures
from twin.diagnose.report.pictures import RESIDUAL_MAP, STAGES, Picture, drawing, rms, short, without
from twin.diagnose.result.diagnosis import Diagnosis, Series
from twin.pictures.style import INK

ROWS = 40  # sensors that a picture shows at most, those with the largest residuals
LOADS = 10  # signals in the load strip at most
RUNS = 6  # runs with a map of their own at most
STATE_ROWS, STATES = 16, 7  # sensors and load states at most


def loudest(series: Series, rows: int = ROWS) -> list[int]:
    """Columns of the sensors with the largest residuals as delivered, those without a value last."""
    size = np.nan_to_num(rms(series.delivered), nan=-1.0)
    return np.argsort(-size, kind="stable")[:rows].tolist()


def with_gaps(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (n + 1,) [the unit of time] and rows (n, ...) for a map; where bins are missing a row of NaN stands."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    step = step if step > 0 else 1.0
    edges, rows = [time[0] - step / 2], []
    for t, row in zip(time, values, strict=True):
        if t - step / 2 > edges[-1] + step:
            edges.append(t - step / 2)
            rows.append(np.full_like(row, np.nan))
        edges.append(max(t + step / 2, edges[-1] + 1e-6 * step))
        rows.append(row)
    return np.array(edges), np.array(rows)


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
    stages = (series.delivered, series.recalibrated, series.extended)
    largest = pictures.colour_range(a[:, chosen] for a in stages)
    heights = [max(1.6, 0.17 * len(chosen)), max(0.35, 0.17 * len(names))]
    with drawing(sum(heights) + 1.1, grid=False) as fig:
        panels = fig.subplots(2 if names else 1, 3, squeeze=False, sharex=True, sharey="row",
                              gridspec_kw={"height_ratios": heights if names else heights[:1]})  # fmt: skip
        for k, ((stage, _), residual) in enumerate(zip(STAGES, stages, strict=True)):
            axes = panels[0, k]
            edges, rows = with_gaps(hours, np.asarray(residual, dtype=float)[:, chosen])
            image = axes.pcolormesh(
                edges, np.arange(len(chosen) + 1), rows.T, cmap=RESIDUAL_MAP, vmin=-largest, vmax=largest,
                rasterized=True,
            )  # fmt: skip
            left = float(rms(np.asarray(residual)[:, chosen].ravel()))
            axes.set_title(f"{stage}, {left:.2f} K" if np.isfinite(left) else stage)
            if names and k == 0:  # one strip for all stages: their loads are the same
                edges, rows = with_gaps(hours, loads.T)
                panels[1, k].pcolormesh(
                    edges, np.arange(len(names) + 1), rows.T, cmap=pictures.LOAD_MAP, vmin=0, vmax=1, rasterized=True
                )
            elif names:
                panels[1, k].set_axis_off()
                axes.tick_params(labelbottom=True)
        panels[-1, 0].set_xlabel("time in h")
        panels[0, 0].set_yticks(np.arange(len(chosen)) + 0.5, [short(series.sensors[i]) for i in chosen], fontsize=7.5)
        panels[0, 0].set_ylim(len(chosen), 0)
        if names:
            panels[1, 0].set_yticks(np.arange(len(names)) + 0.5, [short(name) for name in names], fontsize=7.5)
            panels[1, 0].set_ylim(len(names), 0)
        fig.colorbar(image, ax=panels[0, :].tolist(), label="measured - simulated in K", aspect=15, pad=0.01)
    return Picture(
        f"Residuals of {series.run}" + (" (sealed: no value was fitted to it)" if series.sealed else ""),
        "Orange: the machine is warmer than the simulation, blue: colder, grey: no data; what switches with a "
        "row of the strip at the left (dark: large) follows that load, and a good model leaves a pale map"
        + without(len(series.sensors) - len(chosen), "sensors with smaller residuals"),
        fig,
    )


def on_masks(loads: Mapping[str, np.ndarray], bins: int) -> dict[str, np.ndarray]:
    """Which bins a drive is on: per group of signals that go on and off together, a mask (b,); "nothing" for none.

    A signal counts as a drive where it is near zero for some of the time and not always.
    """
    groups: list[tuple[list[str], np.ndarray]] = []
    for name, values in loads.items():
        size = np.abs(np.nan_to_num(np.asarray(values, dtype=float)))
        if len(size) != bins or not size.any():
            continue
        on = size > 0.05 * size.max()
        if not 0.02 < on.mean() < 0.98:
            continue
        for names, mask in groups:
            if (mask == on).mean() > 0.95:
                names.append(name)
                break
        else:
            groups.append(([name], on))
    result = {", ".join(names): mask for names, mask in groups}
    if groups:
        rest = ~np.any([mask for _, mask in groups], axis=0)
        if rest.any():
            result = {"nothing": rest} | result
    return result


def by_load_state(series: Sequence[Series]) -> Picture | None:
    """Mean residual per sensor and load state of the longest run that has several, as delivered and extended."""
    best, masks = None, dict[str, np.ndarray]()
    for s in series:
        found = on_masks(s.loads, len(s.time))
        if len(found) > 1 and s.sensors and (best is None or (len(found), len(s.time)) > (len(masks), len(best.time))):
            best, masks = s, found
    if best is None:
        return None
    chosen = loudest(best, STATE_ROWS)
    names = list(masks)[:STATES]
    stages = (best.delivered, best.extended)
    shown = [np.stack([pictures.mean(a[masks[n]][:, chosen]) for n in names], axis=1) for a in stages]
    largest = max(float(np.nanmax(np.abs(a), initial=0.0)) for a in shown) or 1.0
    with drawing(1.9 + 0.23 * len(chosen), grid=False) as fig:
        panels = fig.subplots(1, 2, sharey=True)
        for axes, title, values in zip(panels, ("as delivered", "extended"), shown, strict=True):
            image = axes.imshow(values, cmap=RESIDUAL_MAP, vmin=-largest, vmax=largest, aspect="auto")
            pictures.write_values(axes, values, largest, "+.2f", 7.0)
            labels = [short(n, 26) for n in names]
            axes.set_xticks(range(len(names)), labels, rotation=25, ha="right", rotation_mode="anchor", fontsize=8)
            axes.set_title(title)
        panels[0].set_yticks(range(len(chosen)), [short(best.sensors[i]) for i in chosen], fontsize=8)
        fig.colorbar(image, ax=panels.tolist(), label="mean residual in K", aspect=18, pad=0.01)
    return Picture(
        f"Residuals of {best.run} by what is on",
        "Mean of measured minus simulated while the signals under a column are above 5 % of their largest: a column "
        "that stands out names the drive whose heat is wrong, a row equal everywhere rather a sensor or the air.",
        fig,
    )


def whiteness_picture(d: Diagnosis) -> Picture | None:
    """Lag-1 correlation per channel before and after; None without a channel."""
    channels = [(c, b, a) for c, b, a in d.whiteness if np.isfinite(b) or np.isfinite(a)]
    channels = sorted(channels, key=lambda w: -np.nan_to_num(w[1], nan=-2.0))[:ROWS]
    if not channels:
        return None
    bins = max((len(s.time) for s in d.series), default=0)
    y = np.arange(len(channels))
    before, after = (np.array([w[k] for w in channels], dtype=float) for k in (1, 2))
    with drawing(1.3 + 0.19 * len(channels)) as fig:
        axes = fig.subplots()
        if bins > 4:
            axes.axvspan(-2 / bins**0.5, 2 / bins**0.5, color=STAGES[0][1], alpha=0.25, lw=0, label="white noise")
        axes.hlines(y, before, after, color=STAGES[0][1], lw=1.0)
        axes.plot(before, y, "o", color=STAGES[1][1], ms=5, mfc="none", label="before: recalibrated")
        axes.plot(after, y, "o", color=STAGES[2][1], ms=5, label="after: extended")
        axes.axvline(0.0, color=INK, lw=0.6)
        axes.set_yticks(y, [short(c) for c, _, _ in channels], fontsize=8)
        axes.set_ylim(len(channels) - 0.5, -0.5)
        axes.set_xlim(min(-0.3, 1.1 * float(np.nanmin(np.append(after, before)))), 1.02)
        axes.set_xlabel("correlation of the residual with itself one bin later")
        axes.set_title("Is what is left only noise?")
        fig.legend(loc="outside right upper")
    return Picture(
        "Whiteness before and after",
        "Near 1 the residual has a shape that a model could still explain, within the grey band it is noise; the "
        "causes should move the dots to the left" + without(len(d.whiteness) - len(channels), "more channels"),
        fig,
    )
