"""The report of a calibration as lines for a reader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from twin.calibrate.channels.table import channel_lines

STOPPED = {
    "minimum": "at the minimum",
    "iterations": "after the allowed iterations, before the minimum",
    "time": "when the time was used up, before the minimum",
    "interrupted": "interrupted, with the best values so far",
}
AT_FIRST = 5  # experiments and combinations shown


def lines(facts: dict[str, Any], output: str) -> list[str]:
    """The table of parameters, what the data cannot separate, and what was written."""
    window = facts["window_model"]
    result = [
        f"stopped {STOPPED[facts['stopped']]}: {facts['iterations']} iterations, {facts['seconds']:.0f} s; "
        f"window model of {window['states']} states, {1e3 * window['rms_temperature_K']:.1f} mK and "
        f"{1e6 * window['rms_displacement_m']:.2f} um (rms) from the artefact at the fitted values"
        + ("" if window["enough"] else " (more than half the noise: intervals are too small)")
    ]
    for run in facts["runs"]:
        left = (
            [f"{run['temperatures']} temperatures to {run['rms_temperature_K']:.3f} K"] if run["temperatures"] else []
        )
        if run["tcp_rows"] and run["rms_displacement_m"] is not None:
            left.append(f"{run['tcp_rows']} TCP rows to {1e6 * run['rms_displacement_m']:.2f} um")
        result.append(f"{run['name']}: {', '.join(left)} (rms)")
        result += [f"  not used: {what}" for what in run["not_used"]]
    result += [f"set aside: {what}" for what in facts["set_aside"]]
    result += channel_lines(facts["channels"], AT_FIRST)
    width = max(len(row["path"]) for row in facts["parameters"])
    result += ["", f"{'parameter':<{width}} {'nominal':>10} {'value':>10} {'+-':>9} {'pull':>6}  unit"]
    for row in facts["parameters"]:
        flags = f"  {'; '.join(row['flags'])}" if row["flags"] else ""
        result.append(
            f"{row['path']:<{width}} {row['nominal']:>10.4g} {row['value']:>10.4g} {row['sigma']:>9.2g} "
            f"{row['pull']:>6.1f}  {row['unit']}{flags}"
        )
    if facts["initial"]:
        worst = max(facts["initial"], key=lambda row: abs(row["value"]))
        result.append(
            f"initial temperatures of {len(facts['initial'])} parts: largest correction {worst['value']:+.2f} K "
            f"({worst['path']})"
        )
    if facts["not_separated"]:
        result += ["", *facts["not_separated"][: AT_FIRST + 1]]
        if len(facts["not_separated"]) > AT_FIRST + 1:
            result.append(f"... and {len(facts['not_separated']) - AT_FIRST - 1} more in the report")
        for name, best in list(facts["experiments"].items())[:AT_FIRST]:
            if best and best[0]["sigma_after"] < 0.9 * best[0]["sigma_before"]:
                result.append(
                    f"would separate {name}: {best[0]['do']} (to {best[0]['sigma_after']:.2f} of the prior, now "
                    f"{best[0]['sigma_before']:.2f})"
                )
    if not facts["description_edited"]:
        result += ["", "the description in the artefact is as it was: editing it takes the packages of 'twin[build]'"]
    report, picture = (Path(output).with_suffix(kind) for kind in (".json", ".png"))
    written = f"{output}, {report} and {picture} (every channel)" if picture.exists() else f"{output} and {report}"
    return [*result, "", f"wrote {written}; next: twin score {output} RUN, on a run it was not fitted to"]
