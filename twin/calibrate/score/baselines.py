"""What a model has to beat: nothing, the last measurement, and what measured temperatures tell without any physics.

Every baseline knows only what could have been known: learned ones are fitted to other runs than those they are scored
on, or to what was measured earlier in the same one; measurements are predicted before they are used.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.score.pieces import MOST_GRID_POINTS, Piece, offset, on_grid, spacing
from twin.calibrate.score.prequential import SAME_PLACE, HoldLast, prequential
from twin.calibrate.score.regression import fit_ridge
from twin.calibrate.transfer_function.identify import Identified, Method, identify
from twin.errors import ModelError

Predict = Callable[[Piece], np.ndarray]  # (n, 3) m at the rows of a piece
Fit = Callable[[Sequence[Piece]], Predict]

MOST_PLACES = 8  # with a transfer function of their own
BLOCKS = 6  # refits where the only run has to teach and test
NAMES = ("zero", "hold last", "regression", "ARX", "OE")


@dataclass(frozen=True)
class Baseline:
    """Predictions of one baseline for every piece that is scored, or why there are none."""

    name: str
    how: str  # what it knew, or why it is not available
    predicted: tuple[np.ndarray, ...] | None  # (n_i, 3) m each, in the order of the pieces


def baselines(
    train: Sequence[Piece],
    scored: Sequence[Piece],
    sealed: Sequence[Piece],
    names: Sequence[str],
    dt: float = 60.0,
    interval: float = 0.0,
) -> tuple[Baseline, ...]:
    """All baselines for the pieces `scored`, then `sealed`, each with TCP rows.

    names: the inputs of the learned ones (`twin.calibrate.score.pieces.input_names`). dt [s]: of OE's grid. interval
    [s]: the held measurement is renewed no more often; 0: at every row.
    """
    pieces = (*scored, *sealed)
    held = tuple(prequential(HoldLast(interval), p.rows.time, p.rows.position, p.rows.measured) for p in pieces)
    often = f"one every {interval / 60.0:g} min" if interval else "every row"
    found = [
        Baseline("zero", "no thermal error at all", tuple(np.zeros_like(p.rows.measured) for p in pieces)),
        Baseline("hold last", f"the last earlier measurement at the same place, {often}", held),
    ]
    if not names:
        reason = "no temperatures that all runs have measured"
        return (*found, *(Baseline(name, reason, None) for name in NAMES[2:]))
    fits: Mapping[str, Fit] = {
        "regression": lambda pieces: regression(pieces, names),
        "ARX": lambda pieces: transfer(pieces, names, "arx", None),
        "OE": lambda pieces: transfer(pieces, names, "oe", dt),
    }
    for name, fit in fits.items():
        try:
            predicted, how = learned(fit, train, scored, sealed)
            found.append(Baseline(name, how, predicted))
        except ModelError as e:
            found.append(Baseline(name, f"not available: {e.problems[0].what}", None))
    return tuple(found)


def learned(
    fit: Fit, train: Sequence[Piece], scored: Sequence[Piece], sealed: Sequence[Piece]
) -> tuple[tuple[np.ndarray, ...], str]:
    """Predictions for `scored`, then `sealed`, by models that never saw what they are scored on; and how that was done.

    With training pieces they are fitted to those. Without: each of several pieces is predicted by a fit to the others;
    the only one, stretch by stretch, by fits to what was measured before, zero until that suffices. Sealed pieces are
    never fitted to.
    """
    if train:
        predict = fit(train)
        return tuple(predict(p) for p in (*scored, *sealed)), f"fitted to {_count(len(train), 'training run')}"
    if len(scored) > 1:
        found = [fit([*scored[:k], *scored[k + 1 :]])(piece) for k, piece in enumerate(scored)]
        how = "no training runs: each run predicted by a fit to the other scored ones"
    elif scored:
        found = [_expanding(fit, scored[0])]
        how = f"no training runs: refitted {BLOCKS - 1} times to what was measured before"
    else:
        raise ModelError("no run to learn from", "", "give runs with --train")
    if sealed:
        predict = fit(scored)
        found += [predict(p) for p in sealed]
        how += "; sealed runs by a fit to the scored ones"
    return tuple(found), how


def regression(pieces: Sequence[Piece], names: Sequence[str]) -> Predict:
    """Ridge regression of dx, dy, dz on the temperatures at the time; where the measured positions differ, on their
    products with the positions too. Raises ModelError where too little was measured."""
    position = np.concatenate([p.rows.position for p in pieces])
    centre, half = 0.5 * (position.max(axis=0) + position.min(axis=0)), 0.5 * np.ptp(position, axis=0)
    moving = half > SAME_PLACE

    def inputs(piece: Piece) -> np.ndarray:
        x = piece.temperatures(names, piece.rows.time)
        if piece.reference is not None:
            x = x - piece.temperatures(names, np.array([piece.reference]))
        place = ((piece.rows.position - centre) / np.where(moving, half, 1.0))[:, moving]
        return np.hstack([x, place, *(x * s[:, None] for s in place.T)])

    x = np.concatenate([inputs(p) for p in pieces])
    y = np.concatenate([p.rows.measured for p in pieces])
    groups = np.repeat(np.arange(len(pieces)), [len(p.rows) for p in pieces])
    fitted = []
    for axis in range(3):
        known = np.isfinite(y[:, axis])
        fitted.append(fit_ridge(x[known], y[known, axis], groups[known]) if known.any() else None)

    def predict(piece: Piece) -> np.ndarray:
        here = inputs(piece)
        return np.column_stack([np.zeros(len(here)) if f is None else f(here)[:, 0] for f in fitted])

    return predict


def transfer(pieces: Sequence[Piece], names: Sequence[str], method: Method, dt: float | None) -> Predict:
    """Transfer functions of paper 003 from temperatures to dx, dy, dz, each with its own inputs and order.

    One for every measured place, for paper 003 knows but one; an unknown place is predicted by the nearest, and where
    there are more than MOST_PLACES, one serves all. Temperatures and deviations count from the first measurement of a
    piece there, where it is taken to be at rest; before it nothing is known, and zero predicted.
    dt [s]: of the grid of times; None: the time between measurements there, for ARX needs them at most grid points.
    Raises ModelError where too little was measured.
    """
    known = _places(np.concatenate([p.rows.position for p in pieces]))
    if len(known) > MOST_PLACES:
        known = known.mean(axis=0, keepdims=True)
    models = []
    for k in range(len(known)):
        there = [replace(p, rows=p.rows.part(_nearest(known, p.rows.position) == k)) for p in pieces]
        models.append(_transfer_at_a_place([p for p in there if len(p.rows)], names, method, dt))

    def predict(piece: Piece) -> np.ndarray:
        own = _places(piece.rows.position)
        one = len(known) == 1 or len(own) > MOST_PLACES
        at = np.zeros(len(piece.rows), dtype=int) if one else _nearest(own, piece.rows.position)
        predicted = np.zeros_like(piece.rows.measured)
        for k in np.unique(at):
            there = piece.rows.part(at == k)
            model = models[int(_nearest(known, there.position[:1])[0])]
            predicted[at == k] = model(replace(piece, rows=there))
        return predicted

    return predict


def _transfer_at_a_place(pieces: Sequence[Piece], names: Sequence[str], method: Method, dt: float | None) -> Predict:
    longest = max(float(np.ptp(p.rows.time)) for p in pieces)
    dt = max(_spacing(pieces) if dt is None else dt, longest / MOST_GRID_POINTS)
    grids = [on_grid(p, names, dt) for p in pieces]
    starts = np.concatenate([[0], np.cumsum([len(u) for u, _, _ in grids])])[:-1].tolist()
    u = np.concatenate([u for u, _, _ in grids])
    y = np.concatenate([y for _, y, _ in grids])
    found: list[Identified | None] = [
        identify(u, y[:, axis], dt, method, starts=starts) if np.isfinite(y[:, axis]).any() else None
        for axis in range(3)
    ]

    def predict(piece: Piece) -> np.ndarray:
        inputs, _, at = on_grid(piece, names, dt)
        drift = np.column_stack([np.zeros(len(at)) if f is None else f(inputs)[at] for f in found])
        if piece.reference is not None:
            return drift
        known = np.isfinite(piece.rows.measured)
        first = np.where(known.any(axis=0), piece.rows.time[np.argmax(known, axis=0)], np.inf)
        return np.where(piece.rows.time[:, None] > first, drift + offset(piece), 0.0)

    return predict


def _places(position: np.ndarray) -> np.ndarray:
    """(m, n_axes) positions that differ by more than SAME_PLACE, in the order of (n, n_axes); at most one more than
    MOST_PLACES."""
    found = position[:1]
    for p in position:
        if len(found) > MOST_PLACES:
            break
        if not (np.abs(found - p) <= SAME_PLACE).all(axis=1).any():
            found = np.concatenate([found, p[None]])
    return found


def _nearest(places: np.ndarray, position: np.ndarray) -> np.ndarray:
    """(n,) index of the place nearest to each position."""
    return np.argmin(((position[:, None] - places[None]) ** 2).sum(axis=2), axis=1)


def _expanding(fit: Fit, piece: Piece) -> np.ndarray:
    """(n, 3): every stretch of the piece by a fit to the rows before it; zero before the first that succeeds."""
    time = piece.rows.time
    edges = [time[k * len(time) // BLOCKS] for k in range(1, BLOCKS)]
    predicted = np.zeros_like(piece.rows.measured)
    reason: ModelError | None = None
    done = False
    for begin, end in zip(edges, [*edges[1:], np.inf], strict=True):
        before, here = time < begin, (time >= begin) & (time < end)
        if not before.any() or not here.any():
            continue
        try:
            predict = fit([replace(piece, rows=piece.rows.part(before))])
        except ModelError as e:
            reason = e
            continue
        predicted[here] = predict(piece)[here]
        done = True
    if not done:
        raise reason or ModelError("too few measurements to learn from", "", "give runs with --train")
    return predicted


def _spacing(pieces: Sequence[Piece]) -> float:
    """Time between measurements [s], the shortest of the pieces' medians."""
    found = [s for s in (spacing(p.rows) for p in pieces) if np.isfinite(s)]
    if not found:
        raise ModelError("fewer than two measured times", "", "give longer runs with --train")
    return min(found)


def _count(n: int, name: str) -> str:
    return f"{n} {name}" if n == 1 else f"{n} {name}s"
