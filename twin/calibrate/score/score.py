"""An artefact scored on measured runs, beside baselines: per sensor and axis, per segment and pooled.

Segments and runs are put together row by row, never as one series: whatever has a memory starts anew in every test.
What the model computes here is a replay of the loads alone: it has not seen any of the measurements.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from twin.calibrate.score.baselines import Baseline, baselines
from twin.calibrate.score.bootstrap import Difference, rms_difference
from twin.calibrate.score.compare import TCP, LeftOut, channels, left_out
from twin.calibrate.score.metrics import Figures, figures
from twin.calibrate.score.pieces import Piece, Rows, input_names, members, rows_of, split
from twin.logs.run import Run, Segment
from twin.logs.trace import Trace
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact
from twin.run.replay import replay

MODEL = "model"
HOLD_FIRST = "hold first"
VECTOR = "vector"
REGRESSION = "regression"  # of `twin.calibrate.score.baselines.NAMES`


@dataclass(frozen=True)
class Settings:
    """How a score is taken."""

    dt: float = 60.0  # s, of the replay
    substeps: int | None = None
    restart: bool = False  # every segment is a test of its own, with its own initial state
    tcp_sigma: float = 1e-6  # m, of a measured deviation where the log does not say
    temperature_sigma: float = 0.1  # K, of a measured temperature
    interval: float = 0.0  # s, between the measurements that "hold last" may use; 0: all
    inputs: tuple[str, ...] = ()  # of learned baselines; empty: all temperatures


@dataclass(frozen=True)
class Entry:
    """Figures of one output by one method, over a segment of a run or pooled ("" for both)."""

    part: str  # "scored" or "sealed"
    run: str
    segment: str
    kind: str  # "temperature" [K] or "tcp" [m]
    output: str  # sensor, "dx", "dy", "dz", "vector" of those measured; "" for all sensors
    method: str
    figures: Figures


@dataclass(frozen=True)
class RunTold:
    """What else is to be said of a run."""

    run: str
    part: str
    synthetic: tuple[str, ...]
    left_out: LeftOut
    flagged_steps: int  # outside what was certified
    steps: int
    outside_segments: int  # TCP rows in no segment
    flags: dict[str, int] = field(default_factory=dict)  # what was outside -> in how many steps, the most first


@dataclass(frozen=True)
class Score:
    """All figures, what the baselines knew, and how sure the difference between model and best baseline is."""

    entries: tuple[Entry, ...]
    runs: tuple[RunTold, ...]
    known: tuple[tuple[str, str], ...]  # (baseline, what it knew or why it is missing)
    air: tuple[str, ...]  # sensors whose temperature is an input of the model: not scored
    best: dict[str, str]  # part -> baseline with the smallest rms over its rows, chosen with hindsight
    difference: dict[str, Difference]  # part -> rms of the model minus that of the best baseline, TCP vectors [m]
    regression: dict[str, Difference] = field(default_factory=dict)  # part -> the same of the ridge regression
    traces: tuple[Trace, ...] = ()  # every scored channel, a trace per test


@dataclass(frozen=True)
class _Test:
    """One piece with all that is scored in it."""

    part: str
    piece: Piece
    segments: tuple[Segment, ...]
    temperatures: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]  # sensor -> time, measured and simulated rise
    traces: tuple[Trace, ...]


def score(
    artefact: Artefact,
    scored: Sequence[tuple[str, Run]],
    sealed: Sequence[tuple[str, Run]] = (),
    train: Sequence[tuple[str, Run]] = (),
    settings: Settings = Settings(),
    progress: Progress = silent,
) -> Score:
    """Replay (name, run) of `scored` and `sealed` and compare; learned baselines are fitted to `train`.

    Temperatures count as rises over what the sensor measured first in the test, the computed ones too, so that an
    initial state that is off shows. Raises LogError as `twin.run.replay.replay` and
    `twin.calibrate.score.compare.channels`.
    """
    air = tuple(name for name, _ in artefact.model.ambient_sensors)
    tests: list[_Test] = []
    told: list[RunTold] = []
    parts = {"scored": scored, "sealed": sealed, "train": train}
    todo = [(name, run, part) for part, runs in parts.items() for name, run in runs]
    with progress("runs", len(todo)) as advanced:
        for name, run, part in todo:
            made, about = _replayed(artefact, name, run, part, air, settings)
            tests += made
            told.append(about)
            advanced(name)
    with_tcp = {part: [t for t in tests if t.part == part and len(t.piece.rows)] for part in parts}
    found = _baselines(with_tcp, settings)
    predictions = _predictions([*with_tcp["scored"], *with_tcp["sealed"]], found)
    entries: list[Entry] = []
    best, difference, regression = {}, {}, {}
    for part in ("scored", "sealed"):
        entries += _temperatures([t for t in tests if t.part == part], part, settings.temperature_sigma)
        entries += _tcp(with_tcp[part], part, predictions)
        rival = _best_baseline(entries, part)
        if rival is not None:
            best[part] = rival
            difference[part] = _difference(with_tcp[part], predictions, rival)
            if all((REGRESSION, id(t)) in predictions for t in with_tcp[part]):
                regression[part] = _difference(with_tcp[part], predictions, REGRESSION)
    known = tuple((b.name, b.how) for b in found)
    traces = tuple(t for test in tests if test.part != "train" for t in test.traces)
    return Score(tuple(entries), tuple(told), known, air, best, difference, regression, traces)


def run_name(path: str) -> str:
    """As a picture and a table of channels say it."""
    return Path(path).name or path


def _replayed(
    artefact: Artefact, name: str, run: Run, part: str, air: tuple[str, ...], settings: Settings
) -> tuple[list[_Test], RunTold]:
    """The tests of one run, and what of it is not scored."""
    tests, flagged, steps, lost = [], 0, 0, []
    named: Counter[str] = Counter()
    for test, segments in split(run, settings.restart):
        result = replay(artefact, test, settings.dt, settings.substeps)
        found = channels(artefact, test, result)
        rows = rows_of(found, settings.tcp_sigma)
        reference = None
        if test.tcp is not None and test.tcp_reference == "first" and len(test.tcp.time):
            reference = float(test.tcp.time[0])
        rises = {
            c.name: (c.time, c.measured - c.measured[0], c.simulated - c.measured[0])
            for c in found
            if c.kind == "temperature" and c.name not in air
        }
        traces = tuple(
            Trace(run_name(name), c.name, c.unit, c.time, c.measured, c.measured, c.simulated)
            for c in found
            if c.name not in air
        )
        tests.append(_Test(part, Piece(test, name, rows, reference), segments, rises, traces))
        flagged += int(result.flags.any(axis=1).sum())
        named += Counter(dict(zip(result.flag_names, result.flags.sum(axis=0).tolist(), strict=True)))
        steps += len(result.time) - 1
        lost.append(left_out(test, result))
    inside = sum(int(rows.sum()) for t in tests for rows in members(t.segments, t.piece.rows.time))
    total = 0 if run.tcp is None else len(run.tcp.time)
    first = lost[0]
    about = LeftOut(
        first.unknown,
        first.unmeasured,
        sum(x.temperature_rows for x in lost),
        sum(x.tcp_rows for x in lost),
        sum(x.tcp_incomplete for x in lost),
        sum(x.tcp_outside_grid for x in lost),
    )
    references = sum(t.piece.reference is not None for t in tests)
    elsewhere = total - inside - about.tcp_rows - about.tcp_incomplete - references
    return tests, RunTold(
        name, part, run.synthetic, about, flagged, steps, max(elsewhere, 0), {k: n for k, n in named.most_common() if n}
    )


def _baselines(with_tcp: dict[str, list[_Test]], settings: Settings) -> tuple[Baseline, ...]:
    """Baselines fitted to "train" and predicting "scored" and "sealed"; none where neither has TCP rows."""
    pieces = {part: [t.piece for t in tests] for part, tests in with_tcp.items()}
    names = input_names([piece.run for found in pieces.values() for piece in found], settings.inputs)
    if not pieces["scored"] and not pieces["sealed"]:
        return ()
    return baselines(pieces["train"], pieces["scored"], pieces["sealed"], names, settings.dt, settings.interval)


def _best_baseline(entries: Sequence[Entry], part: str) -> str | None:
    """The baseline of the smallest rms over all TCP vectors of a part."""
    pooled = {
        e.method: e.figures.rms
        for e in entries
        if (e.part, e.run, e.output) == (part, "", VECTOR) and e.method != MODEL
    }
    return min(pooled, key=lambda method: pooled[method]) if pooled else None


def _predictions(tests: Sequence[_Test], found: Sequence[Baseline]) -> dict[tuple[str, int], np.ndarray]:
    """(method, id of the test) -> (n, 3) m."""
    every = {(MODEL, id(t)): t.piece.rows.simulated for t in tests}
    for baseline in found:
        if baseline.predicted is not None:
            every |= {(baseline.name, id(t)): p for t, p in zip(tests, baseline.predicted, strict=True)}
    return every


def _temperatures(tests: Sequence[_Test], part: str, sigma: float) -> list[Entry]:
    """Per segment and sensor, then pooled per sensor, then over all of them."""
    entries: list[Entry] = []
    pooled: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}

    def add(run: str, segment: str, sensor: str, measured: np.ndarray, simulated: np.ndarray) -> None:
        for method, computed in ((MODEL, simulated), (HOLD_FIRST, np.zeros_like(measured))):
            told = figures(measured, computed, np.full(len(measured), sigma))
            entries.append(Entry(part, run, segment, "temperature", sensor, method, told))

    for test in tests:
        for sensor, (time, measured, simulated) in test.temperatures.items():
            for segment, rows in zip(test.segments, members(test.segments, time), strict=True):
                if rows.any():
                    add(test.piece.name, segment.name, sensor, measured[rows], simulated[rows])
                    pooled.setdefault(sensor, []).append((measured[rows], simulated[rows]))
    joined = {sensor: tuple(np.concatenate(x) for x in zip(*found, strict=True)) for sensor, found in pooled.items()}
    for sensor, (measured, simulated) in joined.items():
        add("", "", sensor, measured, simulated)
    if joined:
        add("", "", "", *(np.concatenate(x) for x in zip(*joined.values(), strict=True)))
    return entries


def _tcp(tests: Sequence[_Test], part: str, predictions: dict[tuple[str, int], np.ndarray]) -> list[Entry]:
    """Per segment, component and method, then pooled."""
    entries: list[Entry] = []
    axes = _measured_axes(tests)
    pooled: dict[str, list[tuple[Rows, np.ndarray]]] = {}
    for test in tests:
        methods = [method for method, which in predictions if which == id(test)]
        for segment, rows in zip(test.segments, members(test.segments, test.piece.rows.time), strict=True):
            if not rows.any():
                continue
            for method in methods:
                one = (test.piece.rows.part(rows), predictions[method, id(test)][rows])
                entries += _components(part, test.piece.name, segment.name, method, [one], axes)
                pooled.setdefault(method, []).append(one)
    for method, found in pooled.items():
        entries += _components(part, "", "", method, found, axes)
    return entries


def _measured_axes(tests: Sequence[_Test]) -> list[int]:
    """Components that any test has measured: the vector is of these."""
    return [k for k in range(3) if any(np.isfinite(t.piece.rows.measured[:, k]).any() for t in tests)]


def _components(
    part: str, run: str, segment: str, method: str, found: Sequence[tuple[Rows, np.ndarray]], axes: list[int]
) -> list[Entry]:
    """dx, dy, dz and the vector of those in `axes`, over rows where all that is needed was measured."""
    measured = np.concatenate([rows.measured for rows, _ in found])
    sigma = np.concatenate([rows.sigma for rows, _ in found])
    computed = np.concatenate([predicted for _, predicted in found])
    entries = []
    for k in axes:
        known = np.isfinite(measured[:, k])
        if known.any():
            told = figures(measured[known, k], computed[known, k], sigma[known])
            entries.append(Entry(part, run, segment, "tcp", TCP[k], method, told))
    known = np.isfinite(measured[:, axes]).all(axis=1)
    if known.any():
        told = figures(measured[known][:, axes], computed[known][:, axes], sigma[known])
        entries.append(Entry(part, run, segment, "tcp", VECTOR, method, told))
    return entries


def _difference(tests: Sequence[_Test], predictions: dict[tuple[str, int], np.ndarray], name: str) -> Difference:
    """rms of the model's TCP vectors minus that of a baseline, over the same rows."""
    axes = _measured_axes(tests)
    lengths: dict[str, list[np.ndarray]] = {MODEL: [], name: []}
    for test in tests:
        for rows in members(test.segments, test.piece.rows.time):
            measured = test.piece.rows.measured[rows][:, axes]
            known = np.isfinite(measured).all(axis=1)
            for method, into in lengths.items():
                computed = predictions[method, id(test)][rows][:, axes]
                into.append(np.linalg.norm(measured[known] - computed[known], axis=1))
    return rms_difference(lengths[MODEL], lengths[name])
