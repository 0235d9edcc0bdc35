"""Times of a log: seconds, or ISO 8601 with a zone, as seconds since the start of the run."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, tzinfo
from zoneinfo import ZoneInfo

import numpy as np

from twin.errors import LogError


def zone_of(name: str, where: str) -> ZoneInfo:
    """The zone of an IANA name ("Europe/Berlin"). Raises LogError for an unknown one."""
    try:
        return ZoneInfo(name)
    except (KeyError, ValueError, OSError) as e:  # zoneinfo raises all of these for odd names
        raise LogError(f"unknown time zone '{name}'", where, "write an IANA name, for example 'Europe/Berlin'") from e


def parse_iso(cells: Sequence[str], zone: tzinfo | None, where: str) -> tuple[np.ndarray, bool]:
    """POSIX seconds (n,) of ISO 8601 cells, and whether any of them came without a zone.

    Naive times are read in `zone`; where it is None they are refused, for an hour is 6 K of a warming machine.
    Raises LogError with the line (cell i stands on line i + 2 of `where`).
    """
    seconds = np.empty(len(cells))
    naive = False
    for i, cell in enumerate(cells):
        try:
            moment = datetime.fromisoformat(cell.strip().strip('"'))
            if moment.tzinfo is None:
                naive = True
                if zone is None:
                    raise LogError(
                        f"time '{cell.strip()}' has no zone",
                        f"{where} (line {i + 2})",
                        'write 2026-03-01T08:00:00+01:00, or name the zone in run.toml: zone = "Europe/Berlin"',
                    )
                moment = moment.replace(tzinfo=zone)
            seconds[i] = moment.timestamp()
        except (ValueError, OverflowError, OSError) as e:
            raise LogError(
                f"'{cell.strip()[:40]}' is neither a number nor an ISO 8601 time",
                f"{where} (line {i + 2})",
                "write seconds under 'time [s]', or 2026-03-01T08:00:00+01:00 under 'time'",
            ) from e
    return seconds, naive
