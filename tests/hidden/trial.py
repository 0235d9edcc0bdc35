"""A trial of tests/hidden: another machine, what is hidden in it or in its log, and what should be said of it.

What is hidden in the machine is a `Cause`, put into its text as `twin hide` does it (`hidden_text`); signals of its
history are felt and not logged. What is hidden in the log is done to a stored truth on reading, by
`twin.inject.damage.kinds`: such trials need no file of their own.
"""

from __future__ import annotations

import hashlib
import json
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tests.hidden.load import MODEL, RUNS
from twin.diagnose.diagnosis import Cause, Verdict, Window
from twin.inject.damage.channels import Damage
from twin.logs.read import read_run
from twin.machine.effects.edits import extended_description, loads_with

HOUR, END = 3600.0, 13.0 * 3600.0  # s; END: after the last row of every run


@dataclass(frozen=True)
class Expected:
    """What a diagnosis should say. A place "" is one that nobody can name; size and place of a fault of a log are those
    of `twin.inject.damage.kinds`."""

    verdicts: tuple[Verdict, ...]  # any of them is right
    family: str  # of the first cause, "" where nothing is to be found
    place: str
    size: float  # SI, in `unit`; nan where there is none
    unit: str
    history: str  # in words, or the kind of a family that has several: "drift", "clock"
    further: tuple[tuple[str, str], ...] = ()  # (family, place) of other causes
    families: tuple[str, ...] = ()  # names that are right as well, where nature confounds them
    places: tuple[str, ...] = ()  # likewise


@dataclass(frozen=True)
class Trial:
    """One row of the table. Where nothing is done to the machine, `truth` names the file of another trial."""

    name: str
    expected: Expected
    seed: int = 0  # of the other machine
    causes: tuple[Cause, ...] = ()  # in the machine
    damages: tuple[tuple[str, Damage], ...] = ()  # (run, or "" for all; what is done to its log)
    before: Mapping[str, float] = field(default_factory=dict)  # h of work before the start of a run
    warm: Mapping[tuple[str, str], float] = field(default_factory=dict)  # (run, body) -> K warmer at its start
    loads: Mapping[str, float] = field(default_factory=dict)  # signal -> what it really was, in parts of what is logged
    truth: str = ""  # file, of the trial's own name where empty
    states: int = 0  # the artefact that it is diagnosed with keeps so few; 0: any

    @property
    def noise(self) -> int:
        """The seed of its measurement noise."""
        return zlib.crc32(self.name.encode())

    @property
    def file(self) -> str:
        return self.truth or self.name


def hidden_text(text: str, found: Trial) -> tuple[str, dict[str, dict[str, np.ndarray]]]:
    """The text of a machine with the causes of a trial in it, and per run the signals (n,) that it feels and the log
    lacks or has otherwise."""
    edit = extended_description(text, found.causes, "hidden")
    felt: dict[str, dict[str, np.ndarray]] = {}
    for name in RUNS if edit.signals or found.loads else ():
        columns = loads_with(read_run(MODEL / "runs" / name), edit.signals).loads.columns
        felt[name] = {signal: columns[signal] for signal in edit.signals}
        felt[name] |= {signal: factor * columns[signal] for signal, factor in found.loads.items()}
    return edit.text, felt


def about(found: Trial) -> dict[str, object]:
    """What is said of a trial in its file, as JSON can say it."""
    e = found.expected
    hidden = {"family": e.family, "place": e.place, "size": None if math.isnan(e.size) else e.size, "unit": e.unit}
    return {
        "seed": found.seed,
        "hidden": {**hidden, "history": e.history, "further": [list(f) for f in e.further]}
        if found.causes or found.warm or found.loads
        else None,
        "before": dict(found.before),
        **({"warm": [[*key, by] for key, by in found.warm.items()]} if found.warm else {}),
        "made_of": _digest(found),
    }


def _digest(found: Trial) -> str:
    """Of everything that decides what the machine does: a file of another table is out of date."""
    causes = [
        [c.family, c.place, repr(c.amplitude), c.unit, c.signal, c.exponent, sorted(c.settings.items()),
         [[w.run, w.start, w.end, w.level] for w in c.windows]]
        for c in found.causes
    ]  # fmt: skip
    more = [sorted([*key, by] for key, by in found.warm.items()), sorted(found.loads.items())]
    told = json.dumps([found.seed, causes, sorted(found.before.items()), *(m for m in more if m)])
    return hashlib.sha256(told.encode()).hexdigest()[:16]


def cause_of(
    family: str, place: str, amplitude: float, unit: str, signal: str = "", exponent: float = 1.0,
    windows: tuple[Window, ...] = (), settings: Mapping[str, float | str] = {},
) -> Cause:  # fmt: skip
    return Cause(
        family=family, place=place, parameter="", amplitude=amplitude, ci95=(amplitude, amplitude), unit=unit,
        statistic=math.inf, threshold=0.0, history=signal or ("windows" if windows else "always"), signal=signal,
        exponent=exponent, windows=windows, settings=settings,
    )  # fmt: skip


def in_machine(
    name: str, seed: int, cause: Cause, *further: Cause, verdicts: tuple[Verdict, ...] = ("named",)
) -> Trial:  # fmt: skip
    expected = Expected(
        verdicts, cause.family, cause.place, cause.amplitude, cause.unit, cause.history,
        tuple((c.family, c.place) for c in further),
    )  # fmt: skip
    return Trial(name, expected, seed, (cause, *further))


def in_log(
    name: str, damage: Damage, unit: str, verdict: Verdict, runs: tuple[str, ...] = ("",),
    families: tuple[str, ...] = (), places: tuple[str, ...] = (),
) -> Trial:  # fmt: skip
    history = damage.history
    expected = Expected((verdict,), damage.family, damage.place, damage.size, unit, history, (), families, places)
    return Trial(name, expected, damages=tuple((run, damage) for run in runs), truth="null_0")


def hours(run: str, *stretches: tuple[float, float]) -> tuple[Window, ...]:
    return tuple(Window(run, a * HOUR, b * HOUR) for a, b in stretches)


def bell(run: str, start: float, end: float, level: float) -> tuple[Window, ...]:
    """A sine squared between two hours, in steps of 10 min."""
    edges = np.arange(start, end + 1e-9, 1.0 / 6.0)
    height = level * np.sin(math.pi * (edges + 1.0 / 12.0 - start) / (end - start)) ** 2
    return tuple(
        Window(run, a * HOUR, b * HOUR, float(h)) for a, b, h in zip(edges[:-1], edges[1:], height[:-1], strict=True)
    )


def telegraph(seed: int) -> tuple[tuple[Window, ...], tuple[Window, ...]]:
    """Stretches of one and of the other sign: it turns at random, every 50 min in the mean."""
    rng = np.random.default_rng(seed)
    signs: tuple[list[Window], list[Window]] = ([], [])
    for run in RUNS:
        at, which = 0.0, int(rng.integers(2))
        while at < END:
            until = min(at + rng.exponential(50.0 * 60.0), END)
            signs[which].append(Window(run, at, until))
            at, which = until, 1 - which
    return tuple(signs[0]), tuple(signs[1])
