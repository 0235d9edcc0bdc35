"""Whatever comes in, no output ever steps further than the slew limit, nothing hangs, and every arrival is counted."""

from __future__ import annotations

import math
import random
from array import array

import pytest

from tests.live.scripted import FACTS, NAMES, UNITS, Kept, Listed, block, run, runtime
from twin.live.limiter import Limits
from twin.live.offsets import at, size
from twin.live.publisher import Patience, Publisher
from twin.logs.resolver import Damaged

LIMITS = Limits(20e-6, 0.2e-6, 1.0)
SPECIAL = (math.nan, math.inf, -math.inf, 85.0, 1e308, -1e308, 5e-324, 0.0, -0.0, 1e9)


def fuzzed(rng: random.Random, n: int):
    """Blocks of any number, time, stream and values; damaged ones, silence."""
    stream, sequence, time = 1, 0, 1e9
    for _ in range(n):
        what = rng.random()
        if what < 0.03:
            yield Damaged(truncated=rng.random() < 0.5)
            continue
        if what < 0.06:
            yield None
            continue
        if what < 0.07:
            stream, sequence = rng.randrange(1, 5), 0
        if what < 0.10:
            time += rng.choice((-1e6, -100.0, -3.0, 3.0, 100.0, 1e5, 1e7))
        shown = sequence + (rng.randrange(-6, 7) if what > 0.9 else rng.choice((10**7, 2**40)) if what > 0.89 else 0)
        records = rng.choice((1, 1, 1, 2, 9))
        values = array("d")
        for _ in range(records):
            row = [rng.uniform(0.0, 0.5), rng.uniform(0.0, 25.0), rng.uniform(15.0, 30.0)]
            if rng.random() < 0.2:
                row[rng.randrange(3)] = rng.choice(SPECIAL)
            values.extend(row)
        names, units = (NAMES, UNITS) if rng.random() > 0.01 else (("air", "x", "front"), ("degC", "1", "degC"))
        yield block(max(shown, 0), values, time, stream, interval=rng.choice((10.0, 10.0, 0.01, 7.3)), names=names,
                    units=units)  # fmt: skip
        sequence, time = sequence + 1, time + 10.0 * records


def assert_never_jumps(sent, form, limits):
    """Of the offsets themselves, at places all over the stroke, and as the bound that the limiter goes by."""
    before = None
    most = limits.slew * limits.period * (1 + 1e-9)
    for one in sent:
        for values in one.values:
            assert all(math.isfinite(v) for v in values)
            assert size(values, form) <= limits.most * (1 + 1e-9)
        if before is not None:
            for a, b in zip(before, one.values, strict=True):
                step = [q - p for p, q in zip(a, b, strict=True)]
                assert size(step, form) <= most
                assert max(abs(at(FACTS, step, form, [x])) for x in (0.0, 0.1, 0.25, 0.4, 0.5)) <= most
        before = one.values


def fuzz(folder, n, form, seed):
    rng = random.Random(seed)
    arrivals = list(fuzzed(rng, n))
    sink = Kept()
    made = runtime(folder, Listed(arrivals), sink, LIMITS, form, journal=1 << 20)
    made.begin(True)
    while not made.source.ended:
        sink.away = rng.random() < 0.02
        made.once(0.0)
        made.publisher.tick(made.clock.now() + rng.choice((0.0, 0.1, 1.0, 5.0)))
    counts = made.resolver.counts
    waiting = made.resolver.waiting
    arrived = sum(a is not None for a in arrivals)
    assert counts.delivered + counts.repeated + counts.late + counts.damaged + waiting == arrived
    assert made.journal.bytes < 2 << 20
    made.close()
    assert {s.mode for s in sink.sent} > {"following"}
    assert max(abs(v) for s in sink.sent for axis in s.values for v in axis) > 1e-6
    assert_never_jumps(sink.sent, form, LIMITS)


@pytest.mark.parametrize("form", ["grid", "polynomial"])
def test_no_step_above_the_slew_limit(form, tmp_path):
    fuzz(tmp_path, 3000, form, 1)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
def test_no_step_above_the_slew_limit_in_100_000_inputs(seed, tmp_path):
    fuzz(tmp_path, 25_000, ("grid", "polynomial")[seed % 2], 10 + seed)


def test_a_sink_that_was_away_goes_on_from_where_it_stood():
    one, other = Kept(), Kept()
    still, far = ((0.0,) * 3,), ((10e-6,) * 3,)
    publisher = Publisher([one, other], still, "grid", Limits(20e-6, 1e-6, 1.0), Patience())
    publisher.aim(far)
    for t in range(20):
        other.away = 3 <= t < 15
        publisher.alive(float(t), 0.0, "", 1.0)
        publisher.tick(float(t))
    assert one.sent[-1].values == far
    assert other.sent[-1].values[0][0] == pytest.approx(8e-6)
    assert publisher.outlets[1].failures == 12
    assert_never_jumps(other.sent, "grid", publisher.limits)


def test_silence_freezes_then_goes_to_neutral_and_says_so():
    sink = Kept()
    publisher = Publisher([sink], ((0.0,) * 3,), "grid", Limits(20e-6, 1e-6, 1.0), Patience(60.0, 600.0))
    publisher.aim(((5e-6,) * 3,))
    for t in range(20):
        publisher.alive(float(t), 0.0, "", 10.0)
        publisher.tick(float(t))
    for t in range(20, 720):
        publisher.tick(float(t))
    modes = [s.mode for s in sink.sent]
    first = {mode: modes.index(mode) for mode in ("following", "frozen", "to neutral", "neutral")}
    assert list(first) == sorted(first, key=first.get)
    assert first["frozen"] == pytest.approx(19 + 20 + 60, abs=2)  # two blocks, then the patience
    assert first["to neutral"] == pytest.approx(19 + 20 + 600, abs=2)
    assert "stands still" in sink.sent[first["frozen"]].words
    assert "nothing has arrived" in sink.sent[first["frozen"]].words
    assert sink.sent[first["to neutral"]].values[0] == pytest.approx((4e-6,) * 3)
    assert sink.sent[-1].values == ((0.0,) * 3,)


def test_a_signal_that_stays_impossible_freezes_the_correction(tmp_path):
    good = [block(k, [0.1, 15.0, 21.0]) for k in range(60)]
    bad = [block(k, [0.1, 15.0, 85.0]) for k in range(60, 150)]
    sink = Kept()
    made = run(tmp_path, Listed(good + bad), sink)
    words = [s.words for s in sink.sent]
    assert any("no good value of air" in w and "stands still" in w for w in words)
    assert sink.sent[-1].mode in ("to neutral", "neutral")
    assert "air" in made.health()["words"]


def test_a_model_that_fails_goes_to_neutral_and_says_so(tmp_path):
    arrivals = [block(k, [0.1, 15.0, 21.0]) for k in range(60)]
    sink = Kept()
    made = runtime(tmp_path, Listed(arrivals), sink)
    made.begin(True)
    while made.source.at < 40:
        made.once(0.0)
    made.intake.engine.told["T"] = 1e12
    made.run(lambda: False)
    assert "beyond reason" in made.failure
    assert sink.sent[-1].mode in ("to neutral", "neutral")
    assert made.health()["trust"].startswith("no: the model has failed")
