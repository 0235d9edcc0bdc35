"""A step evaluated in pieces is the step evaluated at once, to rounding."""

from __future__ import annotations

from dataclasses import fields
from itertools import pairwise

import numpy as np
import pytest
import synthetic

from twin.rom.drive import evaluate, evaluate_between
from twin.rom.following import Following
from twin.rom.joined import joined

LOAD = synthetic.load_model()


@pytest.mark.parametrize("cuts", [(), (11.0,), (3.0, 20.0, 21.0)])
def test_pieces_make_the_step(cuts):
    time, signals = synthetic.loads(LOAD, hours=0.02, sampling=1.0)
    edges = [0.0, *cuts, 60.0]
    pieces = []
    for begin, end in pairwise(edges):
        here = (time >= begin) & (time <= end)
        own = {name: values[here] for name, values in signals.items()}
        pieces.append(evaluate_between(LOAD, time[here], own, np.array([0.0, end - begin]), 60.0))
    made, whole = (
        joined(pieces),
        evaluate(LOAD, time[time <= 60.0], {n: v[time <= 60.0] for n, v in signals.items()}, 60.0, 1),
    )
    assert np.ptp(whole.power) > 1.0
    for f in fields(whole):
        one, other = getattr(made, f.name), getattr(whole, f.name)
        if isinstance(other, Following):
            np.testing.assert_allclose(one.value, other.value, rtol=1e-9, atol=1e-12, err_msg=f.name)
            np.testing.assert_array_equal(one.outside, other.outside)
        elif isinstance(other, np.ndarray) and f.name != "flags":
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12, err_msg=f.name)
    raised = [{n for n, r in zip(d.flag_names, d.flags[0], strict=True) if r} for d in (made, whole)]
    assert raised[0] == raised[1]


def test_what_any_piece_flags_the_step_flags():
    time, signals = synthetic.loads(LOAD, hours=0.02, sampling=1.0)
    current = next(s for s in LOAD.signals if s.name == "x_current")
    signals = signals | {"x_current": np.where((time > 5) & (time < 9), 2.0 * current.high, 0.0)}
    pieces = []
    for begin, end in ((0.0, 30.0), (30.0, 60.0)):
        here = (time >= begin) & (time <= end)
        own = {name: values[here] for name, values in signals.items()}
        pieces.append(evaluate_between(LOAD, time[here], own, np.array([0.0, end - begin]), 60.0))
    raised = [{n for n, r in zip(p.flag_names, p.flags[0], strict=True) if r} for p in (*pieces, joined(pieces))]
    above = f"signals.x_current above {current.high:g} {current.unit}"
    assert above in raised[0]
    assert above not in raised[1]
    assert raised[2] == raised[0] | raised[1]
