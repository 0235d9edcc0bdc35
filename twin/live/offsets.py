"""Axis offsets out of errors at the poses, as values on the grid or as coefficients of polynomials.

offset = -J^+ w at every pose (`twin.run.correction_axes`), of a platform on struts minus the errors of their lengths
(`twin.run.correction_struts`); the polynomials are those of `twin correction`, fitted to
the offsets, with s = clip((position - centre) / half_range, -1, 1) per axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import mul
from typing import Literal

from twin.live.facts import Facts

Form = Literal["grid", "polynomial"]
Values = tuple[tuple[float, ...], ...]  # m, per axis: at every pose, or coefficients


def offsets(facts: Facts, errors: Sequence[float], form: Form) -> Values:
    """What is added to each axis [m], out of c errors [m] at each pose, c * pose + component (`Engine.errors`)."""
    c = len(facts.offset_per_error[0])
    poses = [errors[c * k : c * (k + 1)] for k in range(facts.poses)]
    at_poses = [tuple(sum(map(mul, row, pose)) for pose in poses) for row in facts.offset_per_error]
    if form == "grid":
        return tuple(at_poses)
    return tuple(
        tuple(sum(f * v for f, v in zip(row, values, strict=True)) for row in facts.fit) for values in at_poses
    )


def neutral(facts: Facts, form: Form) -> Values:
    """No correction."""
    n = facts.poses if form == "grid" else len(facts.fit)
    return ((0.0,) * n,) * len(facts.axes)


def size(values: Sequence[float], form: Form) -> float:
    """What the offset of an axis [m] is at most, anywhere: a grid is read linearly, and |s| <= 1 in polynomials."""
    if form == "grid":
        return max(max(values), -min(values))
    return sum(abs(v) for v in values)


def at(facts: Facts, values: Sequence[float], form: Form, position: Sequence[float]) -> float:
    """The offset of one axis [m] at a position [m] of the axes of the poses, as a control is to evaluate it."""
    if form == "polynomial":
        terms = [1.0]
        for axis, p in zip(facts.axes, position, strict=True):
            s = max(-1.0, min(1.0, (p - axis.centre) / axis.half_range))
            terms = [t * s**k for t in terms for k in range(axis.degree + 1)]
        return sum(t * v for t, v in zip(terms, values, strict=True))
    weights = [(0, 1.0)]
    for nodes, p in zip(facts.pose_grid, position, strict=True):
        k = 0
        while k < len(nodes) - 2 and nodes[k + 1] <= p:
            k += 1
        w = 0.0 if len(nodes) == 1 else max(0.0, min(1.0, (p - nodes[k]) / (nodes[k + 1] - nodes[k])))
        last = min(k + 1, len(nodes) - 1)
        weights = [(i * len(nodes) + j, v * u) for i, v in weights for j, u in ((k, 1.0 - w), (last, w)) if u]
    return sum(v * values[i] for i, v in weights)
