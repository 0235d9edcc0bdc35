"""What `twin rtest` prints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def text(told: Mapping[str, Any]) -> str:
    ranges = ", ".join(
        f"{a} {1e3 * low:.0f} to {1e3 * high:.0f} mm" for a, (low, high) in sorted(told["ranges_m"].items())
    )
    lines = [f"{told['run']}: chain {told['chain']}; {ranges}; places of the balls taken as {told['balls']}"]
    if told["rows_left_out"]:
        lines.append(f"{told['rows_left_out']} rows of tcp.csv lack a position or a deviation and are left out")
    if told["tcp_reference"] == "first":
        lines.append("deviations count from the first row of tcp.csv, and with them the shift")
    for f in told["measurements"]:
        rms = "  ".join(f"d{c} {1e6 * v:.1f}" for c, v in zip("xyz", f["deviation_rms_m"], strict=True))
        lines += ["", f"{f['number']}: {f['start_s'] / 3600:.2f} h, {f['rows']} rows; rms of the deviations {rms} um"]
        if "errors" not in f:
            lines.append(f"  too few rows for axis errors: {f['rows_needed']} are needed")
            continue
        lines += _table(f)
        lines += [_rigid(f, "shift", "m", "d", "um"), _rigid(f, "tilt", "rad", "about ", "urad")]
        if f["hidden_text"]:
            lines.append(
                f"  {len(f['determined'])} of {f['errors']} determined, rank {f['rank']}; hidden: "
                + ", ".join(f["hidden_text"])
            )
        else:
            lines.append(f"  all {f['errors']} determined")
        for c in f["seen_only_together"]:
            lines.append(f"  seen only together: {c['text']} = {1e6 * c['value_m']:.1f} +- {1e6 * c['sigma_m']:.1f} um")
        hint = "; are the places of the balls known?" if told["balls"] == "known" else ""
        verdict = f"MISFIT, more than noise: +- is widened to match{hint}" if f["misfit"] else "as the noise allows"
        lines.append(f"  residual {1e6 * f['residual_rms_m']:.2f} um rms, noise {1e6 * f['noise_m']:.2f} um: {verdict}")
        if "model" in f:
            lines += _model(f["model"])
    return "\n".join(lines)


def _table(f: dict[str, Any]) -> list[str]:
    """Rows EX., EY. ... and squareness, a column per axis; the model's value in brackets."""
    names = [*f["determined"], *f["not_determined"]]
    axes = sorted({n[2] for n in names})
    computed = f.get("model", {}).get("errors", {})

    def cell(name: str) -> str:
        if name not in names:
            return ""
        if name not in f["determined"]:
            return "hidden" if name not in _together(f) else "together"
        e = f["determined"][name]
        model = f" ({1e6 * computed[name]:.1f})" if name in computed else ""
        return f"{1e6 * e['value']:.1f} +- {1e6 * e['sigma']:.1f}{model}"

    rows = [("", *axes)]
    rows += [(f"E{d}. [{'um' if d in 'XYZ' else 'urad'}]", *(cell(f"E{d}{a}") for a in axes)) for d in "XYZABC"]
    for d in "CBA":
        squareness = [cell(f"{d}0{a}") for a in axes]
        if any(squareness):
            rows.append((f"{d}0. [urad]", *squareness))
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return [
        "  "
        + "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))]).rstrip()
        for row in rows
    ]


def _together(f: dict[str, Any]) -> set[str]:
    return {name for c in f["seen_only_together"] for name in c["weights"]}


def _rigid(f: dict[str, Any], name: str, unit: str, prefix: str, shown: str) -> str:
    computed = f.get("model", {}).get(f"{name}_{unit}", [None] * 3)
    values = zip("xyz", f[f"{name}_{unit}"], f[f"{name}_sigma_{unit}"], computed, strict=True)
    cells = [
        f"{prefix}{c} {1e6 * v:.1f} +- {1e6 * s:.1f}" + ("" if m is None else f" ({1e6 * m:.1f})")
        for c, v, s, m in values
        if v is not None
    ]
    return f"  {name.ljust(12)}  {'  '.join(cells)} {shown}"


def _model(m: dict[str, Any]) -> list[str]:
    v = m["volume"]
    lines = [
        f"  in brackets the model: residual {1e6 * m['residual_rms_m']:.2f} um rms",
        f"  over its poses, up to {1e6 * v['largest_m']:.1f} um: shift {100 * v['shift']:.1f} %, "
        f"tilt {100 * v['tilt']:.1f} %, axis errors {100 * v['axis_errors']:.1f} %, rest {100 * v['rest']:.1f} % "
        f"(up to {1e6 * v['largest_rest_m']:.1f} um)",
    ]
    if m["rows_outside_the_poses"]:
        lines.append(f"  {m['rows_outside_the_poses']} rows lie outside its poses: it gives the error at their border")
    return lines
