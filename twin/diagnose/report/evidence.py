"""Pictures of the evidence: statistics against data without an effect, candidates, their similarity, pulls."""

from __future__ import annotations

import numpy as np

from twin.diagnose.report import pictures
from twin.diagnose.report.pictures import DELIVERED, EXTENDED, RECALIBRATED, Picture, drawing, short, without
from twin.diagnose.report.text import history_words
from twin.diagnose.result.diagnosis import Cause, Diagnosis, Rival
from twin.diagnose.result.numbers import size_words
from twin.pictures.style import INK

CANDIDATES = 15
PULLS = 40
_LEAST = 0.02  # of the threshold: smaller statistics stand at the edge of the picture


def nulls_picture(d: Diagnosis) -> Picture | None:
    """Per family the statistics of data without an effect, and of these data, in units of the family's threshold."""
    families = [f for f in dict.fromkeys([*d.thresholds, *d.nulls]) if _threshold(d, f) > 0]
    if not families:
        return None
    scale = np.random.default_rng(0)  # only where in its row a dot stands
    seen = {f: d.observed[f] / _threshold(d, f) for f in families if np.isfinite(d.observed.get(f, np.nan))}
    families.sort(key=lambda f: -seen.get(f, 0.0))
    shown = [0.5, *seen.values()]
    with drawing(1.4 + 0.3 * len(families)) as fig:
        axes = fig.subplots()
        for row, family in enumerate(families):
            values = np.asarray(d.nulls.get(family, []), dtype=float)
            values = np.maximum(values[np.isfinite(values)] / _threshold(d, family), _LEAST)
            shown += values.tolist()
            axes.plot(
                values, row + scale.uniform(-0.25, 0.25, len(values)), ".", color=DELIVERED, ms=3.5, mew=0, alpha=0.6,
                rasterized=len(values) > 2000,
            )  # fmt: skip
            if family in seen:
                above = seen[family] > 1
                axes.plot(max(seen[family], _LEAST), row, "D", color=EXTENDED if above else RECALIBRATED, ms=7)
        axes.plot([], [], ".", color=DELIVERED, label="data without an effect")
        axes.plot([], [], "D", color=RECALIBRATED, ls="", label="these data, below the threshold")
        axes.plot([], [], "D", color=EXTENDED, ls="", label="these data, above it")
        axes.axvline(1.0, color=INK, lw=1.2)
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
        axes.xaxis.set_minor_formatter(lambda x, _: "")
        axes.set_xlim(0.8 * max(min(shown), _LEAST), 1.5 * max([2.0, *seen.values()]))
        axes.set_yticks(range(len(families)), [family.replace("_", " ") for family in families], fontsize=8.5)
        axes.set_ylim(len(families) - 0.5, -0.5)
        axes.set_xlabel("statistic over the threshold of its family")
        fig.legend(loc="outside upper center", ncols=3)
    return Picture(
        "What chance does",
        "Each grey dot is the best that a family reached in one simulated data set of a machine without any effect; a "
        "diamond right of the line at 1 is more than chance explains.",
        fig,
    )


def _threshold(d: Diagnosis, family: str) -> float:
    value = d.thresholds.get(family, np.nan)
    return float(value) if np.isfinite(value) else 0.0


def candidates_picture(d: Diagnosis) -> Picture | None:
    """The best candidates of the first step: statistic as a bar, threshold as a tick, amplitude and interval beside."""
    these = [r for r in d.ranked if np.isfinite(r.statistic)][:CANDIDATES]
    if not these:
        return None
    largest = max(max(r.statistic for r in these), 1e-9)
    with drawing(1.0 + 0.36 * len(these)) as fig:
        axes = fig.subplots()
        for row, r in enumerate(these):
            above = r.statistic > _threshold(d, r.family)
            axes.barh(row, max(r.statistic, 0.0), color=EXTENDED if above else RECALIBRATED, height=0.6, alpha=0.85)
            tick = _threshold(d, r.family) if _threshold(d, r.family) < 1.02 * largest else 0.0
            if tick:
                axes.plot([tick] * 2, [row - 0.42, row + 0.42], color=INK, lw=1.8)
            axes.text(max(r.statistic, tick) + 0.01 * largest, row, sized(r), va="center", fontsize=8)
        axes.set_yticks(range(len(these)), [labelled(k, r) for k, r in enumerate(these)], fontsize=8)
        axes.set_ylim(len(these) - 0.5, -0.5)
        axes.set_xlim(0, 1.75 * largest)
        axes.set_xlabel("statistic (twice the log-likelihood ratio)")
    return Picture(
        "Candidates, each alone beside everything that can be calibrated",
        "The longer a bar, the better that one cause explains the data, and the black tick is the threshold of its "
        "family; size and 95 % interval stand beside (interval from the statistic, as if the size entered linearly).",
        fig,
    )


def sized(rival: Rival) -> str:
    said = [size_words(rival.amplitude, rival.ci95, rival.unit), history_words(rival.history)]
    return ", ".join(text.replace("95 % interval ", "") for text in said if text)


def labelled(k: int, rival: Rival | Cause) -> str:
    return f"{k + 1}  {short(rival.family.replace('_', ' '), 20)}, {short(rival.place, 26)}"


def cosine_picture(d: Diagnosis) -> Picture | None:
    """Similarity of the ranked candidates; None of fewer than two."""
    cosine = np.asarray(d.cosine, dtype=float)
    n = min(len(d.ranked), CANDIDATES, *cosine.shape) if cosine.ndim == 2 else 0
    if n < 2:
        return None
    cosine = cosine[:n, :n]
    with drawing(1.0 + 0.36 * n, grid=False) as fig:
        axes = fig.subplots()
        image = axes.imshow(cosine, cmap=pictures.RESIDUAL_MAP, vmin=-1, vmax=1, aspect="auto")
        pictures.write_values(axes, cosine, 1.0, ".2f")
        axes.set_xticks(range(n), [str(k + 1) for k in range(n)])
        axes.set_yticks(range(n), [labelled(k, r) for k, r in enumerate(d.ranked[:n])], fontsize=8)
        fig.colorbar(image, ax=axes, label="cosine", pad=0.01)
    return Picture(
        "How alike the candidates are",
        "Two candidates with a cosine near 1 or -1 leave the same trace in these data once everything that can be "
        "calibrated is taken out, and cannot be distinguished; near 0 they can.",
        fig,
    )


def pulls_picture(d: Diagnosis) -> Picture | None:
    """Bars of the largest pulls, with lines at 2 and 3."""
    these = sorted((p for p in d.pulls if np.isfinite(p.pull)), key=lambda p: -abs(p.pull))[:PULLS]
    if not these:
        return None
    with drawing(1.0 + 0.2 * len(these)) as fig:
        axes = fig.subplots()
        colours = [EXTENDED if abs(p.pull) > 3 else "#e69f00" if abs(p.pull) > 2 else RECALIBRATED for p in these]
        axes.barh(range(len(these)), [p.pull for p in these], color=colours, height=0.65)
        widths = [p.sigma if np.isfinite(p.sigma) else 0.0 for p in these]
        axes.errorbar([p.pull for p in these], range(len(these)), xerr=widths, fmt="none", ecolor=INK, elinewidth=0.9)
        for at in (2, 3):
            for sign in (-1, 1):
                axes.axvline(sign * at, color=INK, lw=1.0, ls="--" if at == 2 else "-")
        axes.axvline(0.0, color=INK, lw=0.6)
        axes.set_yticks(range(len(these)), [short(p.path, 40) for p in these], fontsize=8)
        axes.set_ylim(len(these) - 0.5, -0.5)
        reach = max(3.5, 1.05 * max(abs(p.pull) + w for p, w in zip(these, widths, strict=True)))
        axes.set_xlim(-reach, reach)
        axes.set_xlabel(
            "pull: distance from what was declared, in its standard deviations (thin line: posterior ±1 sigma)"
        )
    return Picture(
        "Pulls of the declared parameters",
        "A bar beyond the dashed lines (±2) deserves a look, beyond the solid ones (±3) the declared value or its "
        "tolerance is wrong, or the fit hides an effect in it" + without(len(d.pulls) - len(these), "smaller ones"),
        fig,
    )
