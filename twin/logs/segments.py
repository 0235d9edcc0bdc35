"""The segments of a run, as run.toml names them: phases of a test, or several tests in one log."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

from twin.errors import LogError, Problem
from twin.logs.run import Segment
from twin.nearest import did_you_mean
from twin.units import to_si

_KEYS = ("name", "start", "end")
_EXAMPLE = 'write segments = [{ name = "heating", start = "0 h", end = "4 h" }]'


def read_segments(value: Any, where: str, first: float, last: float) -> tuple[Segment, ...]:
    """The segments in the order of time, from the value of the key in run.toml.

    first, last: times of the first and last load [s]. A segment must begin between them (or at 0), and end no more
    than half its own length after the last, for a log may miss its last rows but not most of a test. Segments may
    leave parts of the run out.

    Raises LogError with all mistakes: no table, keys missing or unknown, no times, empty, outside, overlapping, or
    segments of one name.
    """
    if not isinstance(value, list) or not all(isinstance(v, Mapping) for v in value):
        raise LogError("segments is no list of tables", where, _EXAMPLE)
    problems: list[Problem] = []
    segments = [s for k, entry in enumerate(value) if (s := _segment(k, entry, where, problems))]
    problems += [p for s in segments if (p := _misplaced(s, where, first, last))]
    segments.sort(key=lambda s: (s.start, s.end))
    problems += [*_overlaps(segments, where), *_namesakes(segments, where)]
    if problems:
        raise LogError.collect(problems)
    return tuple(segments)


def _misplaced(segment: Segment, where: str, first: float, last: float) -> Problem | None:
    """An empty segment, or one outside the loads."""
    start, end = segment.start, segment.end
    if not start < end:
        what = f"is empty: it starts at {start:g} s and ends at {end:g} s"
    elif start < min(first, 0.0) or start >= last or end > last + 0.5 * (end - start):
        what = f"{start:g} .. {end:g} s lies outside the loads, {first:g} .. {last:g} s"
    else:
        return None
    remedy = "times count from the start of the run: correct start and end"
    return Problem(f"segment '{segment.name}' {what}", where, remedy)


def _overlaps(segments: list[Segment], where: str) -> Iterator[Problem]:
    """segments in the order of time."""
    for a, b in pairwise([s for s in segments if s.start < s.end]):
        if b.start < a.end:
            what = f"segments '{a.name}' and '{b.name}' overlap between {b.start:g} and {min(a.end, b.end):g} s"
            yield Problem(what, where, "end the one where the other starts, or sooner")


def _namesakes(segments: list[Segment], where: str) -> Iterator[Problem]:
    for name, n in sorted(Counter(s.name for s in segments).items()):
        if n > 1:
            yield Problem(f"{n} segments are called '{name}'", where, "give each its own name")


def _segment(k: int, entry: Mapping[str, Any], where: str, problems: list[Problem]) -> Segment | None:
    """Entry k, or None with what is wrong added to `problems`."""
    place = f"{where}: segments[{k}]"
    unknown = [key for key in entry if key not in _KEYS]
    problems += [Problem(f"unknown key '{key}'", place, did_you_mean(key, _KEYS, "keys")) for key in unknown]
    missing = [key for key in _KEYS if key not in entry]
    if missing:
        problems.append(Problem(f"no {' and no '.join(missing)}", place, _EXAMPLE))
        return None
    if not isinstance(entry["name"], str) or not entry["name"].strip():
        problems.append(Problem("name is no text", place, _EXAMPLE))
        return None
    times = []
    for key in ("start", "end"):
        try:
            times.append(to_si(entry[key], "s"))
        except ValueError as e:
            problems.append(Problem(f"{key}: {e}", place, 'give seconds, or a string with a unit: "4 h"'))
    return Segment(entry["name"], *times) if len(times) == 2 else None
