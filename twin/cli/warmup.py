"""twin warmup: when the machine of a result has warmed up."""

from __future__ import annotations

from typing import Any

import click

from twin.cli.quantity import Quantity


@click.command(epilog="Example: twin warmup out/experiment_a --tolerance '2 um'")
@click.argument("result", type=click.Path())
@click.option(
    "--tolerance", default="1 um", show_default=True, type=Quantity("m"), help="tolerance of the TCP displacement"
)
@click.option("--temperature", default="0.1 K", show_default=True, type=Quantity("delta_degC"),
              help="tolerance of the sensors")  # fmt: skip
@click.option("--horizon", default="1 h", show_default=True, type=Quantity("s"),
              help="settled: at the rate of the end, the drift in this time is less than the tolerance")  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="machine-readable")
def command(result: str, tolerance: float, temperature: float, horizon: float, as_json: bool) -> None:
    """Tell when the machine of RESULT, the folder or result.h5 of a `twin run`, has warmed up.

    Per TCP component (at the actual position, which moves with the axes, and at the pose where it changes most) and per
    sensor: the time from which on the value stays within the tolerance of its final value; t63 and t95, from which on
    it stays within 37 % and 5 % of its largest distance from the final value; the drift at the end, a line through the
    last ten minutes. Where the drift at the end is more than the tolerance in the horizon, or only the last value lies
    within the tolerance, it has not settled and the time is "not reached": the final value is only where the run was
    stopped. The verdict in the first line is that of the TCP at its worst poses; sensors are counted beside it.
    """
    import json

    from twin.face.warmup import warm_up

    told = warm_up(result, tolerance, temperature, horizon)
    click.echo(json.dumps(told, indent=2) if as_json else text(result, told))


def text(result: str, told: dict[str, Any]) -> str:
    """The same as a table: minutes, um and K."""
    labels = {
        name: f"{name} at its worst pose" + "".join(f", {a} {1e3 * v:.0f} mm" for a, v in entry["pose_m"].items())
        for name, entry in told["tcp_worst"].items()
    }
    rows: list[tuple[str, ...]] = [("", "change", "warm", "t63", "t95", "drift at the end")]
    rows += [_row(f"{name} at the actual position", e, "m", 1e6, "um") for name, e in told["tcp_actual"].items()]
    rows += [_row(labels[name], e, "m", 1e6, "um") for name, e in told["tcp_worst"].items()]
    rows += [_row(name, e, "K", 1.0, "K") for name, e in told["sensors"].items()]
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    table = [
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:], strict=True))])
        for row in rows
    ]
    sensors = told["sensors"].values()
    counted = f"{sum(e['settled'] for e in sensors)} of {len(sensors)} sensors settled within {told['tolerance_K']:g} K"
    if not told["tcp_worst"]:
        return "\n".join([f"{result}: the TCP never moves; {counted}", *(line.rstrip() for line in table)])
    if told["settled"]:
        verdict = f"TCP warm after {_minutes(told['time_s'])}"
    else:
        verdict = f"TCP not settled after {told['duration_s'] / 60:.0f} min"
    name, worst = max(told["tcp_worst"].items(), key=lambda item: abs(item[1]["end_rate_m_per_s"]))
    return "\n".join(
        [
            f"{result}: {verdict} (worst poses, within {1e6 * told['tolerance_m']:g} um for "
            f"{told['horizon_s'] / 3600:g} h); {counted}",
            f"fastest drift at the end: {labels[name]}: {_drift(worst, 'm', 1e6, 'um')}",
            *(line.rstrip() for line in table),
        ]
    )


def _row(name: str, entry: dict[str, Any], unit: str, factor: float, shown: str) -> tuple[str, ...]:
    return (
        name,
        f"{factor * entry[f'change_{unit}']:.2f} {shown}",
        _minutes(entry["time_s"]),
        _minutes(entry["t63_s"]),
        _minutes(entry["t95_s"]),
        _drift(entry, unit, factor, shown),
    )


def _drift(entry: dict[str, Any], unit: str, factor: float, shown: str) -> str:
    return f"{3600 * factor * entry[f'end_rate_{unit}_per_s']:+.2f} {shown}/h"


def _minutes(seconds: float | None) -> str:
    return "not reached" if seconds is None else f"{seconds / 60.0:.0f} min"
