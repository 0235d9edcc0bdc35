"""Further windows for a cause that switches, where the data ask for them, one after the other, with edges between the
hours; other hours of a bell in every run.

Causes are compared by these scores before any is refitted: of what a switch at twenty past does to a sensor beside it
full hours can miss half, and something farther away, which is felt more smoothly, would lead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.diagnose.evidence.batch import RIDGE, History, Hypothesis, prepared, score
from twin.diagnose.faults.table import fault_of
from twin.diagnose.search.edges import in_windows
from twin.diagnose.search.policy import POLICY, SearchPolicy
from twin.machine.effects.effect import Window


def grown(h: Hypothesis, g: np.ndarray, block: np.ndarray, policy: SearchPolicy = POLICY) -> Hypothesis:
    """A hypothesis in one window with further windows of the same size where the data ask for them, the best first.

    block (L, L): D^T Pi D among the columns of its place.
    """
    if h.when.bell is not None:
        return _elsewhere(h, g, block, policy)
    if len(h.when.windows) == 0 or h.batch.fixed or not fault_of(h).grows:
        return h
    others = [w for w in h.batch.histories if w.windows]
    W = np.stack([w.weights for w in others])  # (h, q, L)
    spans = _spans(_blocks(h.batch.histories))
    current = refined_edges(h, g, block, policy)
    for _ in range(policy.most_windows - 1):
        now = current.when.weights
        free = np.flatnonzero((np.abs(W) * np.abs(now)).sum(axis=(1, 2)) == 0.0)
        if not len(free):
            break
        unions = [History("", now + W[k], windows=(*current.when.windows, *others[k].windows)) for k in free]
        union = _likeliest(h, unions, g, block)
        if union.statistic < current.statistic + max(policy.growth, policy.growth_share * current.statistic):
            break
        windows = sorted(union.when.windows, key=lambda w: (w.run, w.start))
        current = refined_edges(in_windows(union, windows, spans), g, block, policy)
    return current


def _likeliest(h: Hypothesis, histories: Sequence[History], g: np.ndarray, block: np.ndarray) -> Hypothesis:
    """The hypothesis with the one of some histories that the data like best; block as of `grown`."""
    columns = h.batch.columns[h.place : h.place + 1]
    ready = prepared(replace(h.batch, places=(h.name,), columns=columns, histories=tuple(histories)), block[None])
    scores = score(ready, g)
    k = int(np.argmax(scores.statistic))
    amplitude = tuple(map(float, scores.amplitude[0, k]))
    return replace(h, when=histories[k], statistic=float(scores.statistic[0, k]), amplitude=amplitude)


def refined_edges(h: Hypothesis, g: np.ndarray, block: np.ndarray, policy: SearchPolicy = POLICY) -> Hypothesis:
    """A hypothesis whose windows begin and end at the quarters of blocks that the data like best, one edge after the
    other. What begins or ends with a run stays. A block in which it acts for a part of the time has that part. Not of a
    coolant: a strong film saturates, and a score that takes it as linear says little of when it began. Nor where the
    histories of a family do not tell what each block does, such as those that begin with every run.

    block (L, L): D^T Pi D among the columns of its place.
    """
    parts = _blocks(h.batch.histories)
    if fault_of(h).wets or not parts or not np.allclose(_acting(parts, h.when.windows), h.when.weights):
        return h
    spans, current = _spans(parts), h
    for _ in range(policy.edge_moves):
        shifted = _shifted(parts, current.when.windows)
        tried = [replace(current.when, weights=_acting(parts, w), windows=w) for w in shifted]
        if not tried:
            break
        found = _likeliest(h, tried, g, block)
        if found.statistic < current.statistic + policy.less:
            break
        current = in_windows(found, found.when.windows, spans)
    return current


def _blocks(histories: Sequence[History]) -> list[tuple[Window, np.ndarray]]:
    """The blocks of time that windows are made of, in their order, with their weights (q, L)."""
    shortest = dict[tuple[str, float], History]()
    for own in histories:
        if len(own.windows) == 1:
            (w,) = own.windows
            known = shortest.get((w.run, w.start))
            if known is None or w.end < known.windows[0].end:
                shortest[w.run, w.start] = own
    return [(own.windows[0], own.weights) for own in shortest.values()]


def _spans(parts: Sequence[tuple[Window, np.ndarray]]) -> dict[str, float]:
    """When the last block of every run ends [s]."""
    return {own.run: own.end for own, _ in parts}


def _acting(parts: Sequence[tuple[Window, np.ndarray]], windows: Sequence[Window]) -> np.ndarray:
    """(q, L) weights of windows: of every block the share in which they act."""
    result = np.zeros_like(parts[0][1])
    for own, weights in parts:
        inside = sum(max(min(w.end, own.end) - max(w.start, own.start), 0.0) for w in windows if w.run == own.run)
        result = result + inside / (own.end - own.start) * weights
    return result


def _shifted(parts: Sequence[tuple[Window, np.ndarray]], windows: Sequence[Window]) -> list[tuple[Window, ...]]:
    """Windows with one edge earlier or later by a quarter of a block."""
    result = []
    for i, w in enumerate(windows):
        of_run = [own for own, _ in parts if own.run == w.run]
        quarter = min(own.end - own.start for own in of_run) / 4.0
        first, last = of_run[0].start, of_run[-1].end
        before = max([first, *(o.end for o in windows if o.run == w.run and o.end <= w.start)])
        after = min([last, *(o.start for o in windows if o.run == w.run and o.start >= w.end)])
        for by in (-quarter, quarter):
            if w.start > first and before <= w.start + by <= w.end - quarter:
                result.append((*windows[:i], replace(w, start=w.start + by), *windows[i + 1 :]))
            if w.end < last and w.start + quarter <= w.end + by <= after:
                result.append((*windows[:i], replace(w, end=w.end + by), *windows[i + 1 :]))
    return result


def chilled(h: Hypothesis, g: np.ndarray, block: np.ndarray, policy: SearchPolicy = POLICY) -> Hypothesis | None:
    """A coolant in the windows that plain cold likes best; None where it has those, or heat explains far more.

    In a score cold and a linear film cancel over hours that have neither, and a window that is far too long can lead.
    Heat in all other hours is as good as cold in its own: parameters take the rest.
    """
    if not fault_of(h).wets or len(h.when.windows) == 0:
        return None
    cold, hot = (_plain(h, g, block, sign, policy) for sign in (-1, 1))
    if cold is None or (hot is not None and (1.0 - policy.saturates) * hot.statistic > cold.statistic):
        return None
    windows = _joined(cold.when.windows)
    if windows == h.when.windows:
        return None
    (heat,) = cold.when.weights  # the columns of its film come first, in the same order
    weights = np.stack([np.roll(heat, -(len(heat) // 2)), heat])
    return replace(
        h, when=replace(cold.when, weights=weights, windows=windows), amplitude=(h.amplitude[0], cold.amplitude[0])
    )


def between(h: Hypothesis) -> Hypothesis | None:
    """A coolant that warms in its windows, cold in all other hours instead; None where it does not, or has all hours.
    Heat in all other hours is as good as cold in its own, and beside free parameters may even lead."""
    parts = _blocks(h.batch.histories)
    if not fault_of(h).wets or not h.when.windows or h.amplitude[1] <= 0.0 or not parts:
        return None
    found, spans = list[Window](), _spans(parts)
    for run, end in spans.items():
        now = min(own.start for own, _ in parts if own.run == run)
        for w in (*(w for w in h.when.windows if w.run == run), Window(run, end, end)):
            found += [Window(run, now, w.start)] if w.start > now else []
            now = w.end
    if not found:
        return None
    when = replace(h.when, weights=_acting(parts, found), windows=tuple(found))
    return in_windows(replace(h, when=when, amplitude=(h.amplitude[0], -h.amplitude[1])), found, spans)


def within(h: Hypothesis, windows: Sequence[Window]) -> Hypothesis:
    """A hypothesis that switches, in given windows of its blocks."""
    parts = _blocks(h.batch.histories)
    when = replace(h.when, weights=_acting(parts, windows), windows=tuple(windows))
    return in_windows(replace(h, when=when), windows, _spans(parts))


def _plain(h: Hypothesis, g: np.ndarray, block: np.ndarray, sign: int, policy: SearchPolicy) -> Hypothesis | None:
    """A coolant's heat of one sign without its film, in the windows that it likes best; None if it explains nothing."""
    histories = tuple(replace(w, weights=w.weights[1:]) for w in h.batch.histories)
    own = g[h.batch.columns[h.place]]
    W = np.concatenate([w.weights for w in histories])  # (h, L)
    num, F = W @ own, np.einsum("hl,lm,hm->h", W, block, W, optimize=True)
    statistic = np.where(sign * num > 0.0, num**2 / (F + F.max(initial=0.0) * RIDGE + 1e-12), 0.0)
    k = int(np.argmax(statistic))
    if statistic[k] <= 0.0:
        return None
    batch = replace(h.batch, histories=histories, sign=sign, smallest=0.0)
    amplitude = float(num[k] / F[k])
    return grown(Hypothesis(batch, h.place, histories[k], float(statistic[k]), (amplitude,)), g, block, policy)


def _joined(windows: Sequence[Window]) -> tuple[Window, ...]:
    """Windows in their order, those that touch as one."""
    result: list[Window] = []
    for w in windows:
        if result and result[-1].run == w.run and w.start <= result[-1].end:
            result[-1] = replace(result[-1], end=max(result[-1].end, w.end))
        else:
            result.append(w)
    return tuple(result)


def _elsewhere(h: Hypothesis, g: np.ndarray, block: np.ndarray, policy: SearchPolicy) -> Hypothesis:
    """A bell with its best hour in every run: runs may start at other hours of the day. Greedy, run by run."""
    current = h
    for i in range(2 * h.batch.q):
        run, bell = i % h.batch.q, current.when.bell
        assert bell is not None
        others = []
        for other in h.batch.histories:
            if other.bell is not None and other.bell.length == bell.length:
                weights = current.when.weights.copy()
                weights[run] = other.weights[run]
                centres = tuple(other.bell.centres[run] if r == run else c for r, c in enumerate(bell.centres))
                others.append(replace(current.when, weights=weights, bell=replace(bell, centres=centres)))
        found = _likeliest(h, others, g, block)
        if found.statistic > current.statistic + policy.growth:
            current = found
    return current
