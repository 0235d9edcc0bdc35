"""Every measured channel: a table of how it is met and what of it counted, and a picture beside the model."""

from __future__ import annotations

import matplotlib

from twin.diagnose.report.pictures import PAGE_RC, Picture
from twin.diagnose.report.tables import table
from twin.diagnose.result.diagnosis import Diagnosis
from twin.pictures.channels import CAPTION, channel_figure


def channels_picture(d: Diagnosis) -> Picture | None:
    """Measured beside computed, a panel per channel; sealed runs come last."""
    if not d.traces:
        return None
    with matplotlib.rc_context(PAGE_RC):
        return Picture("Channels: measured and computed", CAPTION, channel_figure(d.traces))


def channels_table(d: Diagnosis) -> str:
    """Those with something wrong first, then those that are met worst."""
    order = sorted(d.channels, key=lambda r: (not (r["wrong"] or r["leaps"]), r["kept"] >= 0.9, -(r["rms"] or 0.0)))
    rows = []
    for r in order:
        rms = "-" if r["rms"] is None else f"{r['rms']:.3f} K" if r["unit"] == "K" else f"{1e6 * r['rms']:.2f} um"
        rows.append([r["channel"], r["run"], rms, f"{100 * r['kept']:.0f} %", str(r["leaps"]), r["wrong"]])
    return (
        table(["channel", "run", "rms that is left", "kept", "leaps", "what is wrong"], rows, (2, 3, 4)) if rows else ""
    )
