"""Times of a log: seconds, or ISO 8601 with a zone, as seconds since the start of the run."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, tzinfo
from zoneinfo import ZoneInfo

import numpy as np

from twin.errors import LogError, Problem

_SHOWN = 10  # problems of one file shown at once


def zone_of(name: str, where: str) -> ZoneInfo:
    """The zone of an IANA name ("Europe/Berlin"). Raises LogError for an unknown one."""
    try:
        return ZoneInfo(name)
    except (KeyError, ValueError, OSError) as e:  # zoneinfo raises all of these for odd names
        raise LogError(f"unknown time zone '{name}'", where, "write an IANA name, for example 'Europe/Berlin'") from e


def in_zone(moment: datetime, zone: tzinfo) -> datetime:
    """A local time in its zone. Raises ValueError where the clock shows it twice, or skips it."""
    moment = moment.replace(tzinfo=zone)
    first, second = moment.utcoffset(), moment.replace(fold=1).utcoffset()
    if first != second and first is not None and second is not None:
        if first > second:
            raise ValueError(f"the clock of {zone} shows {moment:%H:%M} twice on {moment:%Y-%m-%d}")
        raise ValueError(f"the clock of {zone} skips {moment:%H:%M} on {moment:%Y-%m-%d}")
    return moment


def parse_iso(cells: Sequence[str], zone: tzinfo | None, where: str) -> tuple[np.ndarray, bool]:
    """POSIX seconds (n,) of ISO 8601 cells, and whether they came without a zone.

    Naive times are read in `zone`; where it is None they are refused, for an hour is 6 K of a warming machine. So are
    local times that the clock shows twice or never, and files with both kinds of times.
    Raises LogError with the lines (cell i stands on line i + 2 of `where`).
    """
    seconds = np.empty(len(cells))
    problems: list[Problem] = []
    kinds: dict[bool, int] = {}  # naive or not -> the first cell of that kind

    def refuse(i: int, what: str, remedy: str) -> None:
        problems.append(Problem(what, f"{where} (line {i + 2})", remedy))

    for i, cell in enumerate(cells):
        text = cell.strip().strip('"')
        try:
            moment = datetime.fromisoformat(text)
        except ValueError:
            remedy = "write seconds under 'time [s]', or 2026-03-01T08:00:00+01:00 under 'time'"
            refuse(i, f"'{text[:40]}' is neither a number nor an ISO 8601 time", remedy)
        else:
            naive = moment.tzinfo is None
            kinds.setdefault(naive, i)
            try:
                if naive and zone is not None:
                    moment = in_zone(moment, zone)
                seconds[i] = moment.timestamp()
            except (ValueError, OverflowError, OSError) as e:
                refuse(
                    i, f"time '{text[:40]}': {e}", "log the offset with each time, or UTC: 2026-03-01T08:00:00+01:00"
                )
            if naive and zone is None:
                remedy = 'write 2026-03-01T08:00:00+01:00, or name the zone in run.toml: zone = "Europe/Berlin"'
                refuse(i, f"time '{text[:40]}' has no zone", remedy)
        if len(problems) >= _SHOWN:
            break
    if len(kinds) == 2 and not problems:
        what = f"has {'no' if kinds[True] > kinds[False] else 'a'} zone, the times above it are of the other kind"
        refuse(max(kinds.values()), f"this time {what}", "write the offset with every time")
    if problems:
        raise LogError.collect(problems)
    return seconds, True in kinds
