"""Every measured channel of some runs as a row: how well it is met, how much of it stands, what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from twin.calibrate.channels.judge import Judgement, words
from twin.logs.run import Run
from twin.logs.trace import Trace


def channel_rows(traces: Sequence[Trace], judgement: Judgement, names: Sequence[str]) -> list[dict[str, Any]]:
    """A row per run and channel: rms of what was compared [K or m, None where nothing was], share of its readings that
    were used as they are, leaps, and what is wrong, in words. names: of the runs that were judged, in their order."""
    leaps = [(names[k], channel) for k, channel in judgement.leaps]
    return [
        {
            "run": t.run,
            "channel": t.channel,
            "unit": "K" if t.unit == "degC" else t.unit,
            "rms": t.rms if np.isfinite(t.rms) else None,
            "kept": float((t.as_logged & np.isfinite(t.logged)).sum() / max(np.isfinite(t.logged).sum(), 1)),
            "leaps": sum(leap == (t.run, t.channel) for leap in leaps),
            "wrong": t.wrong,
        }
        for t in traces
    ]


def with_findings(traces: Sequence[Trace], judgement: Judgement, names: Sequence[str]) -> tuple[Trace, ...]:
    """The traces with what a judgement found of their channels, in words."""
    found = {(names[k], channel): words(f, names) for f in judgement.findings for k in f.runs for channel in f.channels}
    return tuple(replace(t, wrong=found.get((t.run, t.channel), "")) for t in traces)


def as_set_aside(traces: Sequence[Trace], names: Sequence[str], runs: Sequence[Run]) -> tuple[Trace, ...]:
    """The traces with what `set_aside` has left of their readings. names, runs: after it, in the order of `judge`."""
    tables = {name: run.temperatures for name, run in zip(names, runs, strict=True)}
    result = []
    for t in traces:
        table = tables.get(t.run)
        if table is not None and t.channel in table.columns:
            at = np.clip(np.searchsorted(table.time, t.time), 0, len(table.time) - 1)
            t = replace(t, used=table.columns[t.channel][at])
        result.append(t)
    return tuple(result)


def channel_lines(rows: Sequence[Mapping[str, Any]], most: int, marked_only: bool = False) -> list[str]:
    """The channels that lost weight, leap or are wrong, the least kept first, then those that are met worst."""
    if not rows:
        return []
    marked = sorted((r for r in rows if r["kept"] < 0.9 or r.get("leaps") or r.get("wrong")), key=lambda r: r["kept"])
    others = [r for r in rows if r["rms"] and r not in marked]
    worst = sorted(others, key=lambda r: (r["unit"] != "K", -r["rms"]))
    shown = [*marked[:most], *([] if marked_only else worst[: max(0, most - len(marked))])]
    if not shown:
        return []
    width = max(len(r["channel"]) for r in shown)
    long = max(len(r["run"]) for r in shown)
    lines = [
        "",
        f"{'channel':<{width}} {'run':<{long}} {'rms':>9} {'kept':>6} {'leaps':>6}  ({len(rows)} in the report)",
    ]
    for r in shown:
        rms = "" if r["rms"] is None else f"{r['rms']:.3f} K" if r["unit"] == "K" else f"{1e6 * r['rms']:.2f} um"
        lines.append(
            f"{r['channel']:<{width}} {r['run']:<{long}} {rms:>9} {100 * r['kept']:>4.0f} % {r.get('leaps', 0):>6}"
        )
    return lines
