"""What a fit made of every measured channel: how well it is met, and how much of it counted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from twin.calibrate.channels.judge import Judgement, words
from twin.calibrate.fit.fit import Fit
from twin.logs.trace import Trace

TCP = ("dx", "dy", "dz")


def channel_table(fit: Fit, judgement: Judgement | None, traces: Sequence[Trace] = ()) -> list[dict[str, Any]]:
    """A row per run and channel: rms [K or m], share of weight kept, leaps, and what is wrong with it, in words.

    A reading that is missing, or not used as it was logged (by the traces), keeps nothing; one in an hour that fits far
    worse than the channel's best keeps the ratio of their weights.
    """
    names = [run.name for run in fit.problem.runs]
    logged = {(t.run, t.channel): t.as_logged for t in traces}
    rows = []
    for k, (run, residuals, noise) in enumerate(zip(fit.problem.runs, fit.residual, fit.noise, strict=True)):
        for kind, channels in enumerate((run.measured.sensors, TCP)):
            weight = noise[kind].weight
            for c, channel in enumerate(channels):
                residual = residuals[kind][:, c]
                used = np.isfinite(residual)
                if not len(residual) or (kind == 1 and not used.any()):
                    continue
                own = np.ones(len(residual)) if weight is None else weight[:, c]
                most = float(own[used].max(initial=0.0))
                kept = own[used & logged.get((run.name, channel), used)].sum()
                rows.append(
                    {
                        "run": run.name,
                        "channel": channel,
                        "unit": ("K", "m")[kind],
                        "rms": float(np.sqrt(np.mean(residual[used] ** 2))) if used.any() else None,
                        "kept": float(kept / most / len(residual)) if most > 0.0 else 0.0,
                        **(_of(judgement, k, channel, names) if judgement is not None else {}),
                    }
                )
    return rows


def _of(judgement: Judgement, run: int, channel: str, names: Sequence[str]) -> dict[str, Any]:
    mine = [f for f in judgement.findings if run in f.runs and channel in f.channels]
    return {
        "leaps": sum(leap == (run, channel) for leap in judgement.leaps),
        "wrong": "; ".join(words(f, names) for f in mine),
    }
