"""Temperature channels that are at fault without any model: found before anything is fitted."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from twin.calibrate.channels.finding import UNITS, Finding
from twin.calibrate.channels.judge import Judgement, judge, set_aside
from twin.diagnose.faults.elements import Elements
from twin.diagnose.result.diagnosis import Cause, Window
from twin.diagnose.result.numbers import size_words
from twin.logs.faults.usable import BROKEN, usable
from twin.logs.run import Run
from twin.rom.model import MachineModel

FAMILY = "sensor"  # of everything here
NO_INTERVAL = math.nan, math.nan  # 95 % interval of what rows of a run itself show
REFUTED = "that all other channels refute"  # in the history of a channel: a leap that ...
_SAID = {"leap": "a leap", "offset": "an offset", "drift": "a drift", "swapped": "names"}


def channels_at_fault(
    runs: Sequence[Run], judgement: Judgement, sensors: Sequence[str], names: Sequence[str]
) -> tuple[list[Run], list[Cause]]:
    """Runs without the readings that a judgement is about, which a fit would be dragged along by, and a cause for each
    finding in its order, then for leaps of sensors of the machine that leave no other trace.

    names: of the runs.
    """
    sound = set_aside(runs, judgement.findings)
    told = {(k, channel) for f in judgement.findings for k in f.runs for channel in f.channels}
    causes = [_cause(f, runs, names) for f in judgement.findings]
    return sound, causes + _leaps(sound, sensors, names, told)


def judged_channels(runs: Sequence[Run], model: MachineModel, within: Collection[str] | None = None) -> Judgement:
    """What is wrong with the channels of runs, but for offsets of the machine's sensors in all of them: where a source
    warms one place at all times the others refute its sensor, too, and only a search compares the two."""
    return judge(runs, within, {name for name, _ in model.ambient_sensors})


def warm_place_note(f: Finding, sensors: Collection[str]) -> str:
    """Of an offset in all runs of a channel that no cause explains; sensors: of the model."""
    off = size_words(f.size, f.interval, UNITS[f.what])
    more = "no cause explains it" if f.channels[0] in sensors else "the model has no sensor there"
    return (
        f"{f.channels[0]} is off by {off} from what all other channels say, in all runs: "
        f"a place that is always warmer or colder looks the same, and {more}"
    )


def warmer_air(elements: Elements, environment: str) -> np.ndarray:
    """(blocks,) columns of 1 K warmer air of an environment, one per block; none where no film is in it."""
    return elements.block_of.get(("air", environment), np.zeros(0, dtype=int))


def _cause(f: Finding, runs: Sequence[Run], names: Sequence[str]) -> Cause:
    shown = f.statistic == math.inf  # by rows of the run itself
    whole = [k for k in f.runs if f.what in ("offset", "drift") or k != f.runs[0]]
    ends = {k: f.end if shown else _end(runs[k]) for k in f.runs}
    windows = tuple(Window(names[k], 0.0 if k in whole else f.start, ends[k]) for k in f.runs)
    return Cause(
        FAMILY, f"sensors.{'<>'.join(f.channels)}", "", f.size,
        NO_INTERVAL if shown else f.interval, UNITS[f.what], f.statistic, f.least,
        history=f.what if shown else f"{_SAID[f.what]} {REFUTED}", windows=windows,
    )  # fmt: skip


def _leaps(
    runs: Sequence[Run], sensors: Sequence[str], names: Sequence[str], told: Collection[tuple[int, str]]
) -> list[Cause]:
    """A cause for each sensor that leaps or breaks within a run and was not told, of the size of its first leap."""
    causes = []
    for k, (run, name) in enumerate(zip(runs, names, strict=True)):
        known = {channel for n, channel in told if n == k}
        for f in usable(run, sensors)[1]:
            for channel in (c for c in f.channels if f.kind in BROKEN and c in sensors and c not in known):
                known.add(channel)
                window = Window(name, f.first_time, f.last_time)
                causes.append(
                    Cause(FAMILY, f"sensors.{channel}", "", f.size, NO_INTERVAL, f.unit, math.inf, 0.0,
                          history=f.kind, windows=(window,))
                )  # fmt: skip
    return causes


def _end(run: Run) -> float:
    assert run.temperatures is not None
    return float(run.temperatures.time[-1])
