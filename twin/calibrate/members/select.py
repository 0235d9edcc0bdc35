"""How far members explain displacements, and which drivers the data ask for.

All members of all drivers are taken, with one small prior whose scale and noise the evidence chooses. Rejected, by runs
that nothing was fitted to (docs/members.md): choosing single members by the error of left-out stretches, which overfits
(of a hundred candidates a few agree with three stretches by chance: the better the search, the worse they predicted),
and dropping drivers that the evidence does not ask for. A driver that tells nothing is shrunk to nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibrate.members.evidence import Explained, Sums, explain, held_out, total, with_noise
from twin.progress import Progress, silent

# m/K, prior standard deviations of a member's expansion, of which the evidence takes one: 1 cm to 0.4 m of steel
SCALES = tuple(1e-6 * 2.0 ** (k / 2.0) for k in range(-6, 5))
SURE = 3.0  # of ln evidence: "strong" of Kass, Raftery, Bayes factors, J. Am. Stat. Assoc. 90, 1995 (2 ln B > 6)


@dataclass(frozen=True)
class Joined:
    """A driver in the order in which it adds most; m axes."""

    name: str
    gain: float  # of ln evidence, beside those before
    held_out: np.ndarray  # (m,) m: rms of stretches predicted by the others, with it and those before
    moves: np.ndarray  # (m,) m: rms of what its members do to each axis, all drivers taken together

    @property
    def sure(self) -> bool:
        """Whether the data ask for it strongly; what others add may be chance."""
        return self.gain >= SURE


@dataclass(frozen=True)
class Selected:
    """The outcome; m axes."""

    joined: tuple[Joined, ...]
    explained: Explained  # by all members
    alone: np.ndarray  # (m,) m: held-out rms of the model without any member, its expansions refitted
    held_out: np.ndarray  # (m,) m: of the whole

    @property
    def named(self) -> tuple[Joined, ...]:
        return tuple(j for j in self.joined if j.sure)


def select(stretches: Sequence[Sums], groups: Mapping[str, Sequence[int]], progress: Progress = silent) -> Selected:
    """stretches: what is left out together, two at least; groups: by driver the candidates of its lags."""
    rows, every = total(stretches), [c for group in groups.values() for c in group]
    best: Explained | None = None
    with progress("missing members", len(SCALES) + len(groups)) as advance:
        for scale in SCALES:
            found = with_noise(rows, every, scale)
            if best is None or found.log_evidence > best.log_evidence:
                best = found
            advance(f"{1e6 * scale:.2g} um/K")
        assert best is not None
        joined, taken, now = [], list[str](), explain(rows, (), best.scale, best.noise)
        for _ in groups:
            tried = {
                name: explain(rows, [c for g in (*taken, name) for c in groups[g]], best.scale, best.noise)
                for name in groups
                if name not in taken
            }
            name = max(tried, key=lambda n: tried[n].log_evidence)
            gain = tried[name].log_evidence - now.log_evidence
            if gain <= 0.0:
                break
            taken, now = [*taken, name], tried[name]
            after = held_out(stretches, now.chosen, best.scale, best.noise)
            joined.append(Joined(name, gain, after, _moves(rows, best, groups[name])))
            advance(name)
    alone = held_out(stretches, (), best.scale, with_noise(rows, (), best.scale).noise)
    return Selected(tuple(joined), best, alone, held_out(stretches, every, best.scale, best.noise))


def _moves(rows: Sums, found: Explained, group: Sequence[int]) -> np.ndarray:
    own, at = list(group), [found.chosen.index(c) for c in group]
    square = np.einsum("ms,mst,mt->m", found.a[:, at], rows.FF[:, own][:, :, own], found.a[:, at])
    return np.asarray(np.sqrt(np.maximum(square, 0.0) / np.maximum(rows.rows, 1e-30)))
