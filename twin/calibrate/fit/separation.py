"""What data can distinguish: parameters they see, parameters they do not, and sets of which only combinations count.

With x in prior standard deviations the data's information is J^T J of the whitened Jacobian, and the prior's is 1. An
eigenvector with an eigenvalue below 1 is a combination on which the prior determines more than the data. A parameter
that would be well known if it alone were free, but lies in such a combination, is not separable from its companions
there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

KNOWN = 4.0  # information that halves a prior standard deviation and more counts as seen
SHARE = 0.25  # of a combination: components below do not belong to it


@dataclass(frozen=True)
class Combination:
    """A direction in parameter space that the data leave to the prior."""

    names: tuple[str, ...]
    direction: tuple[float, ...]  # in prior standard deviations, of length 1 with the small components left out
    information: float  # of the data on it; the prior's is 1
    vector: np.ndarray  # (n,) whole


@dataclass(frozen=True)
class Separation:
    """n parameters."""

    learned: np.ndarray  # (n,) 0 .. 1: share of the prior variance that the data took away
    unseen: tuple[str, ...]  # parameters that even alone the data would not determine
    combinations: tuple[Combination, ...]  # of parameters that alone they would


def separation(names: tuple[str, ...], information: np.ndarray) -> Separation:
    """names (n,); information (n, n): J^T J of the data in prior standard deviations."""
    n = len(names)
    posterior = np.linalg.inv(information + np.eye(n))
    alone = np.diag(information)
    known, rest = np.flatnonzero(alone > KNOWN), np.flatnonzero(alone <= KNOWN)
    # what the data know of the visible ones once the others, held by their priors, are free: unseen parameters have
    # null directions of their own, which would mix with those of confounded pairs
    cross = information[np.ix_(known, rest)]
    own = information[np.ix_(rest, rest)] + np.eye(len(rest))
    visible = information[np.ix_(known, known)] - cross @ np.linalg.solve(own, cross.T)
    eigenvalue, vectors = np.linalg.eigh((visible + visible.T) / 2)
    combinations = []
    for value, part in zip(eigenvalue, vectors.T, strict=True):
        v = np.zeros(n)
        v[known] = part
        seen = np.flatnonzero(np.abs(v) > SHARE)
        if value < 1.0 and len(seen) >= 2:
            order = seen[np.argsort(-np.abs(v[seen]))]
            sign = np.sign(v[order[0]])
            combinations.append(
                Combination(
                    tuple(names[i] for i in order), tuple(float(sign * v[i]) for i in order), float(max(value, 0.0)), v
                )
            )
    return Separation(
        learned=np.clip(1.0 - np.diag(posterior), 0.0, 1.0),
        unseen=tuple(names[i] for i in np.flatnonzero(alone < 1.0)),
        combinations=tuple(combinations),
    )


def sentences(found: Separation) -> list[str]:
    """For a reader: one line per finding."""
    lines = []
    if found.unseen:
        lines.append(f"not seen by these data, left at the prior: {', '.join(found.unseen)}")
    for c in found.combinations:
        terms = [f"{'+' if d > 0 else '-'} {abs(d):.2f} {name}" for name, d in zip(c.names, c.direction, strict=True)]
        lines.append(f"not separable: {' '.join(terms).removeprefix('+ ')} (the data know the rest of them only)")
    return lines
