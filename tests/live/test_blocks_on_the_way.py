"""Blocks lost, repeated, reordered, late, damaged, of a clock that leaps: counted, and filled by the stated rules."""

from __future__ import annotations

import math
from array import array
from itertools import pairwise

import pytest

from tests.live.scripted import NAMES, UNITS, Kept, Listed, block, run
from twin.live.block import Block
from twin.logs.resolver import Damaged

BLOCKS = [block(k, [0.1, 5.0 + k % 7, 21.0]) for k in range(100)]


def end_of(folder, arrivals, **more):
    """The machine's state and the counts."""
    made = run(folder, Listed(arrivals, **more))
    return made.intake.engine.saved(), made.health()["input"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return end_of(tmp_path_factory.mktemp("whole"), BLOCKS)[0]


def test_repeated_and_reordered_blocks_change_nothing(whole, tmp_path):
    arrivals = [BLOCKS[k] for k in (0, 1, 1, 3, 2, *range(4, 50), 20, *range(50, 100))]
    state, told = end_of(tmp_path, arrivals)
    assert state == whole
    assert (told["blocks"]["repeated"], told["blocks"]["reordered"], told["blocks"]["lost"]) == (2, 1, 0)


def test_a_lost_block_is_fetched_from_the_store_of_the_source(whole, tmp_path):
    state, told = end_of(tmp_path, BLOCKS[:30] + BLOCKS[33:], stored=BLOCKS)
    assert state == whole
    assert told["fetched_from_source"] == 3
    assert told["blocks"]["lost"] == 0


def test_a_lost_block_that_nobody_has_is_held_through(whole, tmp_path):
    state, told = end_of(tmp_path, BLOCKS[:30] + BLOCKS[33:])
    held = BLOCKS[:30] + [block(k, list(BLOCKS[29].values)) for k in (30, 31, 32)] + BLOCKS[33:]
    assert told["blocks"]["lost"] == 3
    assert (told["gaps"], told["held_s"]) == (1, 30.0)
    assert state != whole
    assert end_of(tmp_path / "held", held)[1]["records"] == 100


def test_a_late_block_is_counted_and_left_out(tmp_path):
    arrivals = BLOCKS[:30] + BLOCKS[31:60] + [BLOCKS[30]] + BLOCKS[60:]
    _, told = end_of(tmp_path, arrivals)
    assert (told["blocks"]["lost"], told["blocks"]["late"], told["records"]) == (1, 1, 99)


def test_damaged_blocks_are_counted(whole, tmp_path):
    state, told = end_of(tmp_path, [*BLOCKS[:5], Damaged(), *BLOCKS[5:]])
    assert state == whole
    assert told["blocks"]["damaged"] == 1


@pytest.mark.parametrize("leap", [-3600.0, 7200.0])
def test_a_clock_that_is_set_changes_nothing_but_a_count(leap, whole, tmp_path):
    arrivals = BLOCKS[:40] + [block(k, list(BLOCKS[k].values), 1e9 + 10.0 * k + leap) for k in range(40, 100)]
    state, told = end_of(tmp_path, arrivals)
    assert state == whole
    assert (told["clock_leaps"], told["gaps"]) == (1, 0)


def test_without_numbers_grouping_does_not_matter(tmp_path):
    rows = [(10.0 * k, [0.1, float(k % 9), 21.0]) for k in range(120) if not 60 <= k < 90]
    single = [Block(1, k, t, 60.0, NAMES, UNITS, array("d", v)) for k, (t, v) in enumerate(rows)]
    grouped, at = [], 0
    for n in (7, 20, 33, 30):
        part = rows[at : at + n]
        ok = all(b[0] - a[0] == 10.0 for a, b in pairwise(part))
        for piece in [part] if ok else [[r] for r in part]:
            grouped.append(Block(1, at, piece[0][0], 10.0, NAMES, UNITS, array("d", [x for r in piece for x in r[1]])))
        at += n
    one, told = end_of(tmp_path / "a", single, numbered=False)
    other, _ = end_of(tmp_path / "b", grouped, numbered=False)
    assert one == other
    assert told["gaps"] == 1


def test_impossible_values_are_held_and_counted(whole, tmp_path):
    spikes = list(BLOCKS)
    spikes[20] = block(20, [0.1, BLOCKS[20].values[1], 85.0])
    spikes[30] = block(30, [7.0, BLOCKS[30].values[1], 21.0])
    spikes[40] = block(40, [math.inf, BLOCKS[40].values[1], 21.0])
    spikes[50] = block(50, [0.1, BLOCKS[50].values[1], 29.0])
    state, told = end_of(tmp_path, spikes)
    assert told["values_refused"] == {"not finite": 1, "out of range": 2, "too fast": 1}
    assert state == whole


def test_the_machine_waits_for_all_its_channels(tmp_path):
    some = [block(k, [0.1, math.nan, 21.0]) for k in range(3)] + BLOCKS[3:]
    _, told = end_of(tmp_path, some)
    assert told["records_before_start"] == 3


def test_a_column_in_another_unit_is_not_used_and_said(tmp_path):
    wrong = [block(k, [0.1, 5.0, 21.0], units=("m", "V", "degC")) for k in range(20)]
    made = run(tmp_path, Listed(wrong), sink := Kept())
    assert made.health()["input"]["columns_not_used"] == {"x_current": "is in V, not in A"}
    assert "x_current" in sink.sent[-1].words
