"""When the machine of a result has warmed up."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.face.inputs import Quantity, positive

if TYPE_CHECKING:
    from twin.run.warmup import History, Settling, WarmUp


def warm_up(
    result: str | Path, tolerance: Quantity = "1 um", temperature: Quantity = "0.1 K", horizon: Quantity = "1 h"
) -> dict[str, Any]:
    """When TCP and sensors of a result.h5, or of the folder it is in, have settled within their tolerances; settled
    means that at the rate of the end the drift within the horizon is less than the tolerance. JSON values, SI units in
    the names. Raises TwinError for other files."""
    from twin.run.warmup import read_history
    from twin.run.warmup import warm_up as found_in

    band, kelvin = positive("tolerance", tolerance, "m"), positive("temperature", temperature, "delta_degC")
    ahead = positive("horizon", horizon, "s")
    history = read_history(Path(result))
    found = found_in(history, band, kelvin, ahead)
    return facts(history, found, {"tolerance_m": band, "tolerance_K": kelvin, "horizon_s": ahead})


def facts(history: History, found: WarmUp, options: dict[str, float]) -> dict[str, Any]:
    """Everything `twin warmup` tells, as JSON values: SI units in the names, null for "not reached"."""

    def entry(s: Settling, unit: str) -> dict[str, Any]:
        return {
            f"change_{unit}": s.change,
            f"final_{unit}": s.final,
            "settled": s.settled,
            "time_s": s.time,
            "t63_s": s.t63,
            "t95_s": s.t95,
            f"end_rate_{unit}_per_s": s.rate,
        }

    def pose(index: int) -> dict[str, float]:
        return dict(zip(history.pose_axes, history.poses[index].tolist(), strict=True))

    return {
        **options,
        "duration_s": found.duration,
        "rate_window_s": found.window,
        "settled": found.settled,
        "time_s": found.time,
        "tcp_actual": {f"d{name}": entry(s, "m") for name, s in found.actual.items()},
        "tcp_worst": {f"d{name}": {"pose_m": pose(k), **entry(s, "m")} for name, (k, s) in found.worst.items()},
        "sensors": {name: entry(s, "K") for name, s in found.sensors.items()},
    }
