"""Blocks dropped, repeated, reordered and damaged: every count exact, every delivered record once, nothing invented."""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.logs.test_read import write
from tests.support import synthetic
from twin.cli.main import run
from twin.errors import LogError
from twin.logs.block_file import append, decode, encode, read_blocks
from twin.logs.blocks import Block, group, in_order, resolve, tables
from twin.logs.check import check_run
from twin.logs.compress import compress_loads
from twin.logs.read import read_run
from twin.logs.resolver import Counts, Damaged, Resolver
from twin.logs.unpack import unpack
from twin.logs.write import write_run
from twin.rom.drive import evaluate

NAMES, UNITS = ("x", "i", "v"), ("m", "A", "m/s")
T_CORE = 0.01
START = 1.772e9  # POSIX
MILLION = 10**6  # further away than that a number counts as damaged (docs/load_blocks.md)


def blocks(n: int, size: int = 5, start: float = START, stream: int = 7) -> list[Block]:
    """Record k holds k, -k, k^2."""
    k = np.arange(float(n * size))
    return list(group([np.column_stack([k, -k, k**2])], NAMES, UNITS, start, T_CORE, size, stream))


@given(st.lists(st.integers(0, 9), min_size=1, max_size=20), st.integers(1, 6))
def test_grouping_loses_nothing(sizes: list[int], size: int):
    rows = np.arange(float(sum(sizes)))[:, None]
    chunks = np.split(rows, np.cumsum(sizes)[:-1])
    made = list(group(chunks, ["a"], ["m"], 3.0, 0.5, size))
    assert [b.sequence for b in made] == list(range(len(made)))
    assert all(len(b.values) == size for b in made[:-1])
    assert np.concatenate([b.values for b in made] or [rows]).tolist() == rows.tolist()
    assert [b.time for b in made] == [3.0 + 0.5 * size * k for k in range(len(made))]


@st.composite
def transmissions(draw: st.DrawFn) -> list[tuple[int, bool]]:
    """(sequence, sound) in order of arrival: each of n blocks arrives 0 to 3 times, damaged or not, in any order."""
    n = draw(st.integers(1, 25))
    copies = [(s, draw(st.booleans()) or draw(st.booleans())) for s in range(n) for _ in range(draw(st.integers(0, 3)))]
    return draw(st.permutations(copies))


def arriving(made: list[Block], sent: list[tuple[int, bool]]) -> list[bytes]:
    """What arrives of a transmission: a damaged copy has one byte of its values flipped."""
    frames = []
    for s, sound in sent:
        frame = bytearray(encode(made[s]))
        if not sound:
            frame[-12] ^= 0x40
        frames.append(bytes(frame))
    return frames


@settings(max_examples=300)
@given(transmissions())
def test_counts_are_exact_and_records_appear_once(sent: list[tuple[int, bool]]):
    """Through the frames themselves."""
    made = blocks(26)
    frames = arriving(made, sent)
    sound = [s for s, good in sent if good]
    arrived = set(sound)
    if not arrived:
        with pytest.raises(LogError, match="no sound block"):
            resolve(decode(b"".join(frames)))
        return
    resolved = resolve(decode(b"".join(frames)))
    firsts = list(dict.fromkeys(sound))
    assert resolved.counts == Counts(
        delivered=len(arrived),
        lost=max(arrived) + 1 - len(arrived),
        repeated=len(sound) - len(arrived),
        reordered=sum(any(b > a for b in firsts[:k]) for k, a in enumerate(firsts)),
        damaged=len(sent) - len(sound),
    )
    table = resolved.table
    assert np.all(np.diff(table.time) > 0)
    there = np.isfinite(table.columns["x"])
    expected = np.concatenate([made[s].values for s in sorted(arrived)])
    assert np.column_stack([table.columns[n][there] for n in NAMES]).tolist() == expected.tolist()
    assert table.time[there] == pytest.approx(START + T_CORE * expected[:, 0], abs=1e-6)
    gaps = sum(b - a > 1 for a, b in zip(sorted(arrived), sorted(arrived)[1:], strict=False))
    assert len(resolved.gaps) == gaps
    assert np.count_nonzero(~there) == gaps
    assert all(np.isnan(table.columns[n][~there]).all() for n in NAMES)
    if gaps:
        missing = max(arrived) - min(arrived) + 1 - len(arrived)
        assert np.diff(resolved.gaps, axis=1).sum() == pytest.approx(missing * 5 * T_CORE, abs=1e-5)


@given(st.permutations(range(20)), st.integers(0, 6))
def test_a_window_bounds_what_waits(order: list[int], window: int):
    """Live: what is out is in order and out once; what comes after it was given up is lost and late."""
    made, resolver, out, waiting = blocks(20), Resolver(window), [], 0
    for s in order:
        out += resolver.push(made[s])
        waiting = max(waiting, len(resolver._waiting))
    out += resolver.finish()
    numbers = [b.sequence for b in out]
    assert numbers == sorted(set(numbers))
    assert waiting <= window
    lost, seen = set[int](), set[int]()
    for s in order:  # given up when one `window` later has come
        if s not in lost:
            seen.add(s)
        lost |= {m for m in range(max(seen) - window + 1) if m not in seen}
    assert set(numbers) == seen
    assert resolver.counts.delivered == len(seen)
    assert resolver.counts.lost == resolver.counts.late == len(lost)


def test_in_order_without_loss_nothing_is_counted():
    resolver = Resolver()
    assert [b.sequence for b in in_order(blocks(50), resolver)] == list(range(50))
    assert resolver.counts == Counts(delivered=50)
    assert str(resolver.counts) == "blocks: 50 delivered"


def test_joining_in_midstream_counts_from_there():
    made = blocks(20)
    resolver = Resolver(window=4, first=None)
    numbers = [b.sequence for b in in_order([made[12], made[11], made[14], made[13]], resolver)]
    assert numbers == [12, 13, 14]
    assert resolver.counts == Counts(delivered=3, late=1, reordered=1)
    assert resolve(made[12:]).counts.lost == 12


def test_a_sender_that_starts_anew_begins_another_stream():
    first, second = blocks(4, stream=1), blocks(3, start=START + 100.0, stream=2)
    resolved = resolve([*first[:3], second[0], first[3], second[2]])
    assert resolved.counts == Counts(delivered=5, lost=1, late=1, restarts=1)
    assert str(resolved.counts) == "blocks: 5 delivered, 1 lost, 1 late, 1 restarts"
    assert resolved.gaps[0] - START == pytest.approx([0.15, 100.0], abs=1e-6)
    assert len(resolved.gaps) == 2


def test_a_number_far_ahead_costs_no_memory():
    made = blocks(2)
    resolver = Resolver(window=8)
    out = [*resolver.push(made[0]), *resolver.push(replace(made[1], sequence=MILLION))]
    assert [b.sequence for b in out + resolver.finish()] == [0, MILLION]
    assert resolver.counts == Counts(delivered=2, lost=MILLION - 1)


@pytest.mark.parametrize("at", [0, 3, 6])
@pytest.mark.parametrize("window", [None, 2])
def test_one_absurd_number_is_damaged_and_loses_nothing(at: int, window: int | None):
    made = blocks(6)
    absurd = replace(blocks(7)[6], sequence=2**63)
    resolved = resolve([*made[:at], absurd, absurd, *made[at:]], window)
    assert resolved.counts == Counts(delivered=6, damaged=2)
    assert resolved.table.columns["x"].tolist() == list(range(30))


def test_two_numbers_from_elsewhere_are_where_the_sender_counts():
    """A log that begins in midstream, and a sender that starts its numbers anew within a stream: nothing is lost."""
    made = [replace(b, sequence=b.sequence + 3 * MILLION) for b in blocks(5)]
    assert resolve(made).counts == Counts(delivered=5)
    assert resolve([made[1], made[0], *made[2:]]).counts == Counts(delivered=5, reordered=1)
    anew = blocks(4, start=START + 10.0)
    resolved = resolve([*made, *anew])
    assert resolved.counts == Counts(delivered=9, restarts=1)
    assert len(resolved.gaps) == 1


def test_a_repeat_from_an_ended_stream_is_repeated():
    first, second = blocks(4, stream=1), blocks(2, start=START + 100.0, stream=2)
    resolved = resolve([first[0], first[2], *second, first[0], first[1], first[2], first[3]])
    assert resolved.counts == Counts(delivered=4, lost=1, repeated=2, late=2, restarts=1)


@pytest.mark.parametrize("stream", [7, 8])
@pytest.mark.parametrize("back", [0.02, 0.12, 0.5])
def test_a_clock_that_steps_back_leaves_times_in_order(stream: int, back: float):
    """Within a stream, and where a restarted sender has an earlier stamp: what was given stays, the rest is counted."""
    made = blocks(8)
    cut = 0 if stream == 8 else 4
    set_back = [replace(b, stream=stream, time=b.time - back, sequence=b.sequence - 4 + cut) for b in made[4:]]
    dropped = min(round(back / T_CORE), 20)
    resolved = resolve([*made[:4], *set_back])
    restarts = int(stream == 8)
    assert resolved.counts == Counts(delivered=8, overlapping=dropped, restarts=restarts)
    assert f"; {dropped} overlapping records left out" in str(resolved.counts)
    assert np.all(np.diff(resolved.table.time) > 0.9 * T_CORE)
    assert resolved.table.columns["x"].tolist() == [*range(20), *range(20 + dropped, 40)]
    assert len(resolved.gaps) == 0
    resolver = Resolver(window=2)  # live, piece by piece
    pieces = list(tables(in_order([*made[:4], *set_back], resolver)))
    assert np.array_equal(np.concatenate([p.time for p in pieces]), resolved.table.time)


@given(st.lists(st.floats(-0.2, 0.2), min_size=8, max_size=8))
def test_no_clock_makes_times_go_back(errors: list[float]):
    resolved = resolve([replace(b, time=b.time + e) for b, e in zip(blocks(8), errors, strict=True)])
    there = np.isfinite(resolved.table.columns["x"])
    assert np.all(np.diff(resolved.table.time) > 0)
    assert np.count_nonzero(there) + resolved.counts.overlapping == 40
    assert np.all(np.diff(resolved.table.columns["x"][there]) > 0)


def test_a_trembling_clock_costs_nothing():
    trembling = [replace(b, time=b.time + (-0.4 if b.sequence % 2 else 0.0) * T_CORE) for b in blocks(6)]
    assert resolve(trembling).counts == Counts(delivered=6)


def test_columns_may_not_change():
    made = blocks(2)
    with pytest.raises(LogError, match="other columns"):
        list(tables([made[0], replace(made[1], names=("x", "i", "w"))]))
    with pytest.raises(LogError, match="one column per name"):
        list(group([np.zeros((3, 2))], NAMES, UNITS, 0.0, 0.01))


def same(a: Block, b: Block) -> bool:
    return replace(a, values=0) == replace(b, values=0) and np.array_equal(a.values, b.values, equal_nan=True)


def test_a_file_reads_back(tmp_path: Path):
    made = blocks(6)
    made[2].values[1, 1] = np.nan
    for block in made:
        append(tmp_path / "shift.twb", block)
    back = list(read_blocks(tmp_path / "shift.twb"))
    assert len(back) == 6
    assert all(same(a, b) for a, b in zip(made, back, strict=True))


@given(st.data())
def test_a_truncated_file_keeps_all_whole_blocks(data: st.DataObject):
    made = blocks(4)
    frames = [encode(b) for b in made]
    whole = b"".join(frames)
    cut = data.draw(st.integers(1, len(whole)))
    back = list(decode(whole[:cut]))
    ends = np.cumsum([len(f) for f in frames])
    complete = int(np.searchsorted(ends, cut, side="right"))
    assert [b.sequence for b in back if isinstance(b, Block)] == list(range(complete))
    rest = [b for b in back if isinstance(b, Damaged)]
    assert rest == ([] if cut in ends else [Damaged(truncated=True)])


@given(st.data())
def test_any_damaged_byte_costs_its_own_block_only(data: st.DataObject):
    frames = [encode(b) for b in blocks(4)]
    which = data.draw(st.integers(0, 3))
    at = data.draw(st.integers(0, len(frames[which]) - 1))
    broken = bytearray(frames[which])
    broken[at] ^= data.draw(st.integers(1, 255))
    back = list(decode(b"".join([*frames[:which], bytes(broken), *frames[which + 1 :]])))
    assert [b.sequence for b in back if isinstance(b, Block)] == [s for s in range(4) if s != which]
    assert sum(isinstance(b, Damaged) for b in back) == 1


def framed(text: bytes, records: int = 2, columns: int = 2, time: float = START, interval: float = T_CORE) -> bytes:
    """A frame with right checksums, whatever it says."""
    head = struct.pack("<QQddIHI", 7, 1, time, interval, records, columns, len(text))
    body = text + np.zeros(records * columns).tobytes()
    return b"TWB1" + head + struct.pack("<I", zlib.crc32(head)) + body + struct.pack("<I", zlib.crc32(body))


GOOD = json.dumps([["x", "m"], ["i", "A"]]).encode()


@pytest.mark.parametrize(
    "frame",
    [
        framed(b"5"), framed(b"null"), framed(b""), framed(b"{}"), framed(b'"ab"'), framed(b"[5, 6]"), framed(b"\xff"),
        framed(b"[" * 100_000 + b"]" * 100_000), framed(b"9" * 5000), framed(b'["xm", "iA"]'), framed(b"[[], []]"),
        framed(b'[["x", "m"], ["i", null]]'), framed(b'[["x", "m"], ["\\ud800", "A"]]'),
        framed(b'[["x", "m"], ["x", "A"]]'), framed(b'[["x", "m"]]'), framed(b'[["x", "m"], ["i", "A"], ["v", "A"]]'),
        framed(b"[]", columns=0), framed(GOOD, records=0), framed(GOOD, time=1e300), framed(GOOD, time=np.nan),
        framed(GOOD, interval=0.0), framed(GOOD, interval=1e300), framed(GOOD, interval=np.nan),
    ],
    ids=lambda frame: "frame",
)  # fmt: skip
def test_sound_frames_without_sense_are_one_damaged_block_each(tmp_path: Path, frame: bytes):
    made = blocks(3)
    (tmp_path / "shift.twb").write_bytes(encode(made[0]) + frame + encode(made[1]) + frame + encode(made[2]))
    whole, counts, _ = unpack(tmp_path / "shift.twb")
    assert counts == Counts(delivered=3, damaged=2)
    assert whole.loads.columns["x"].tolist() == list(range(15))
    assert len(list(decode(framed(GOOD)))) == 1
    assert isinstance(next(decode(framed(GOOD))), Block)


def test_writing_goes_on_after_a_crash(tmp_path: Path):
    path, made = tmp_path / "shift.twb", blocks(4)
    append(path, made[0])
    with path.open("ab") as f:
        f.write(encode(made[1])[:70])
    for block in made[2:]:
        append(path, block)
    resolved = resolve(read_blocks(path))
    assert resolved.counts == Counts(delivered=3, lost=1, damaged=1)


@pytest.mark.parametrize(("content", "message"), [(b"", "empty"), (b"time [s],x [m]\n", "holds no blocks")])
def test_other_files_are_refused(tmp_path: Path, content: bytes, message: str):
    (tmp_path / "a.twb").write_bytes(content)
    with pytest.raises(LogError, match=message):
        list(read_blocks(tmp_path / "a.twb"))
    with pytest.raises(LogError, match="cannot read"):
        list(read_blocks(tmp_path / "none.twb"))


def sent(path: Path, made: list[Block]) -> Path:
    path.write_bytes(b"".join(encode(b) for b in made))
    return path


def test_unpack_writes_a_run(tmp_path: Path, capsys):
    made = blocks(200)
    path = sent(tmp_path / "shift.twb", [*made[:60], *made[62:100], made[99], made[101], made[100], *made[102:]])
    assert run(["unpack", str(path), "-o", str(tmp_path / "run")]) == 0
    out = capsys.readouterr().out
    assert "198 delivered, 2 lost, 1 repeated, 1 reordered" in out
    assert "warning: 1 gap" in out
    loads = read_run(tmp_path / "run")
    assert loads.start.timestamp() == pytest.approx(START)
    assert loads.sampling == T_CORE
    assert loads.synthetic == ()
    assert "2 lost, 1 repeated, 1 reordered; 1 gap" in loads.provenance
    assert loads.loads.units == dict(zip(NAMES, UNITS, strict=True))
    there = np.isfinite(loads.loads.columns["i"])
    assert np.flatnonzero(~there).tolist() == [300]
    assert loads.loads.time[there] == pytest.approx(T_CORE * loads.loads.columns["x"][there], abs=1e-6)
    found = [p.what for p in check_run(loads)]
    assert any("a gap" in what for what in found)
    assert any("lacks 1 of" in what for what in found)
    assert run(["unpack", str(path), "-o", str(tmp_path / "run")]) == 2  # measured data are never replaced
    assert "measured data" in capsys.readouterr().err


def test_unpack_tells_of_a_clock_set_back(tmp_path: Path, capsys):
    made = blocks(20)
    set_back = [replace(b, time=b.time - 0.32) for b in made[10:]]
    path = sent(tmp_path / "shift.twb", [*made[:10], *set_back])
    assert run(["unpack", str(path), "-o", str(tmp_path / "run")]) == 0
    said = "20 delivered; 32 overlapping records left out"
    assert said in capsys.readouterr().out
    loads = read_run(tmp_path / "run")
    assert said in loads.provenance
    assert np.all(np.diff(loads.loads.time) > 0)
    assert len(loads.loads.time) == 100 - 32
    assert not [p.what for p in check_run(loads) if "increase" in p.what]


def test_unpack_to_means_is_the_compressed_log(tmp_path: Path):
    path = sent(tmp_path / "shift.twb", blocks(200))
    whole, counts, gaps = unpack(path)
    means, _, _ = unpack(path, 0.5)
    assert (counts, gaps) == (Counts(delivered=200), 0)
    expected = compress_loads(whole.loads, 0.5, end=10.0001)  # stamps are rounded
    assert means.sampling == 0.5
    assert "means over 0.5 s" in means.provenance
    for name in NAMES:
        assert means.loads.columns[name][:-1] == pytest.approx(expected.columns[name], rel=1e-6)
    assert means.loads.time[-1] == pytest.approx(10.0)


@pytest.mark.parametrize(("mean", "rows"), [(10.0, 61), (420.0, 3), (599.0, 3), (600.0, 2), (0.5, 1201)])
def test_means_of_a_sent_log_heat_the_machine_as_its_records_do(tmp_path: Path, mean: float, rows: int):
    """Ten minutes of records every half second; through `evaluate`, over steps that end with the log and after it."""
    load = synthetic.load_model()
    units = {s.name: s.unit for s in load.signals}
    rng = np.random.default_rng(3)
    values = np.column_stack([
        {"degC": 20.0 + noise, "A": 15.0 * noise * (noise > 0.7), "m/s": noise - 0.5}.get(unit, 0.4 + 0.1 * noise)
        for unit, noise in ((unit, rng.random(1200)) for unit in units.values())
    ])  # fmt: skip
    path = sent(tmp_path / "a.twb", list(group([values], tuple(units), tuple(units.values()), START, 0.5, 7)))
    records, means = unpack(path)[0].loads, unpack(path, mean)[0]
    assert len(means.loads.time) == rows
    assert means.loads.time[-1] == pytest.approx(600.0)
    assert means.sampling in (mean, None)
    for dt in (60.0, 450.0):
        ours = evaluate(load, means.loads.time, means.loads.columns, dt)
        exact = evaluate(load, records.time, records.columns, dt)
        assert ours.n_steps == exact.n_steps
        np.testing.assert_allclose(ours.power.sum(axis=0), exact.power.sum(axis=0), rtol=1e-9)
    write_run(tmp_path / "run", means)
    assert not [p for p in check_run(read_run(tmp_path / "run")) if "gap" in p.what or "apart" in p.what]


@pytest.mark.parametrize("mean", [0.001, 0.0099])
def test_means_over_less_than_a_record_are_refused(tmp_path: Path, mean: float, capsys):
    path = sent(tmp_path / "a.twb", blocks(3))
    with pytest.raises(LogError, match=r"records 0\.01 s apart"):
        unpack(path, mean)
    assert run(["unpack", str(path), "-o", str(tmp_path / "run"), "--mean", f"{mean} s"]) == 2
    assert "--mean '0.01 s' or longer" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
    same = unpack(path, 0.01)[0].loads.columns["i"]
    assert same == pytest.approx([*range(15), 14], rel=1e-4)  # stamps are rounded


def test_stamps_that_are_no_dates_count_from_the_start(tmp_path: Path):
    whole, _, _ = unpack(sent(tmp_path / "a.twb", blocks(3, start=12.5)))
    assert whole.start is None
    assert whole.loads.time[0] == 12.5


@pytest.mark.parametrize(
    ("change", "message"), [({"units": ("m", "mA", "m/s")}, "not SI"), ({"units": ("m", "ampere?", "m/s")}, "'i'")]
)
def test_unpack_names_units_that_are_not_si(tmp_path: Path, change: dict, message: str):
    with pytest.raises(LogError, match=message):
        unpack(sent(tmp_path / "a.twb", [replace(blocks(1)[0], **change)]))


def test_unpack_of_a_short_log(tmp_path: Path):
    with pytest.raises(LogError, match="shorter than 60 s"):
        unpack(sent(tmp_path / "a.twb", blocks(3)), 60.0)


def test_unpack_refuses_a_run_in_the_way_before_reading(tmp_path: Path, capsys):
    folder = write(tmp_path / "run", "time [s],x [m]\n0,1\n1,1\n")
    assert run(["unpack", str(tmp_path / "none.twb"), "-o", str(folder)]) == 2
    assert "measured data" in capsys.readouterr().err


SHIFT = Path(__file__).parents[2] / "models" / "five_axis" / "blocks" / "shift.twb"


def test_the_shipped_blocks_are_unpacked(tmp_path: Path, capsys):
    assert run(["unpack", str(SHIFT), "-o", str(tmp_path / "run")]) == 0
    told = capsys.readouterr().out
    assert "59 delivered, 1 lost, 1 reordered" in told
    assert "warning: 1 gap" in told


def test_means_take_the_heat_within_a_gap_as_that_of_the_rest_of_its_interval(tmp_path: Path):
    """A block of a minute is missing from 30 min on: half of an interval of 2 min, all of one of 1 min."""
    whole, _, _ = unpack(SHIFT)
    time, current = whole.loads.time, whole.loads.columns["x_current"]
    for mean, first, last in ((120.0, 1860.0, 1920.0), (60.0, 1800.0, 1800.0)):
        loads = unpack(SHIFT, mean)[0].loads
        (row,) = np.flatnonzero(loads.time == 1800.0)
        there = (time >= first) & (time < last)
        if there.any():
            heat = np.mean(current[there] ** 2)
            assert loads.columns["x_current"][row] ** 2 == pytest.approx(heat, rel=1e-12)
        else:  # runs hold the interval before, and flag this one
            assert np.isnan(loads.columns["x_current"][row])
        others = np.delete(np.arange(len(loads.time) - 1), row)
        inside = [(time >= t) & (time < t + mean) for t in loads.time[others]]
        expected = [np.mean(current[rows] ** 2) for rows in inside]
        assert loads.columns["x_current"][others] ** 2 == pytest.approx(np.array(expected), rel=1e-12)
