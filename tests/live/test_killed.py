"""Killed at any moment, the process goes on with the very same numbers; what is kept stays bounded."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from array import array
from pathlib import Path

import pytest

from tests.live.scripted import Kept, Listed, block, run, runtime
from twin.cli.main import run as command
from twin.errors import TwinError
from twin.face.live import LiveOptions, live, wired
from twin.live.block import Block
from twin.live.checkpoint import Checkpoint, read_checkpoint, write_checkpoint
from twin.live.csv_rows import GrowingFile
from twin.live.csv_source import replay_of
from twin.live.journal import Journal, Position
from twin.live.ring import RingReader, RingWriter
from twin.logs.block_file import read_blocks
from twin.logs.read import read_run

pytestmark = pytest.mark.long

RUN = Path(__file__).parents[1] / "machines" / "spindle" / "runs" / "warm_up"
GROUP = 3  # rows in a block


def blocks() -> list[Block]:
    """The run of the spindle as a sender's blocks, three times over."""
    file = GrowingFile(RUN / "loads.csv")
    lines = file.lines(10_000)
    header = file.header
    assert header is not None
    rows = [header.row(line)[1] for line in lines]
    rows = (rows * 3)[: GROUP * 300]
    return [
        Block(5, k, 1e9 + 10.0 * GROUP * k, 10.0, header.names, header.units,
              array("d", [v for row in rows[GROUP * k : GROUP * (k + 1)] for v in row]))
        for k in range(len(rows) // GROUP)
    ]  # fmt: skip


def process(spindle, ring, state, out):
    command = [sys.executable, "-m", "twin.cli.main", "live", str(spindle), "--source", f"ring:{ring}", "--out",
               f"file:{out}", "--state", str(state), "--initial", "20 degC"]  # fmt: skip
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def wait_for(condition, seconds=60.0):
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "nothing happens"
        time.sleep(0.02)


def through(spindle, state, folder, kills):
    """All blocks through a ring into a process that is killed so many times; the last state."""
    folder.mkdir()
    ring, out, rng = folder / "ring", folder / "c.json", random.Random(4)
    sent = blocks()
    writer = RingWriter(ring, slots=512, slot=1 << 13)
    journal = state / "journal"

    def journalled() -> int:
        return sum(p.stat().st_size for p in journal.glob("*.twb")) if journal.exists() else 0

    at = 0
    for _ in range(kills):
        running = process(spindle, ring, state, out)
        before = journalled()
        wait_for(lambda b=before, s=at: journalled() > b or s == 0)
        for one in sent[at : at + len(sent) // (kills + 1)]:
            writer.write(one)
            time.sleep(rng.random() * 0.002)
        at += len(sent) // (kills + 1)
        time.sleep(rng.random() * 0.05)
        os.kill(running.pid, signal.SIGKILL)
        running.wait()
        writer.write(sent[at])  # while nobody listens
        at += 1
    running = process(spindle, ring, state, out)
    for one in sent[at:]:
        writer.write(one)
    size = len(sent) * 300
    wait_for(lambda: journalled() > size)
    time.sleep(0.5)
    running.terminate()
    told, _ = running.communicate(timeout=30)
    assert running.returncode == 0, told
    return read_checkpoint(state / "checkpoint.bin")


def test_killed_five_times_it_ends_with_the_same_bits(spindle, compiled, tmp_path):
    found = []
    for name, kills in (("whole", 0), ("killed", 5)):
        state = tmp_path / f"state_{name}"
        shutil.copytree(compiled, state / "engine")
        found.append(through(spindle, state, tmp_path / name, kills))
    assert found[0].told["intake"]["records"] == found[1].told["intake"]["records"] == 900
    assert found[0].engine == found[1].engine
    assert found[0].told["intake"]["timeline"] == found[1].told["intake"]["timeline"]


@pytest.mark.parametrize("engine", ["c", pytest.param("jax", marks=pytest.mark.long)])
def test_a_run_in_two_halves_is_one_run(engine, spindle, state, tmp_path):
    lines = (RUN / "loads.csv").read_text().splitlines(keepends=True)
    options, grown = LiveOptions(engine=engine, speed=0.0), tmp_path / "run"
    grown.mkdir()

    def after(folder, rows):
        (grown / "loads.csv").write_text("".join(lines[: rows + 1]))
        return live(spindle, f"replay:{grown}", [f"file:{tmp_path}/c.json"], folder, options).intake

    other = tmp_path / "other"
    shutil.copytree(state, other)
    whole = after(state, 361)
    assert after(other, 152).records == 152
    second = after(other, 361)
    assert second.records == 361
    assert second.engine.saved() == whole.engine.saved()


def test_the_journal_cuts_a_torn_frame_and_can_be_unpacked(tmp_path):
    kept = [block(k, [0.1, 1.0 * k, 21.0]) for k in range(10)]
    journal = Journal(tmp_path, 1 << 20)
    for one in kept[:6]:
        journal.append(one)
    at = journal.position
    journal.append(kept[6])
    journal.close()
    path = tmp_path / "000000001.twb"
    os.truncate(path, path.stat().st_size - 11)
    again = Journal(tmp_path, 1 << 20)
    assert again.position == at
    again.append(kept[7])
    again.close()
    assert list(Journal(tmp_path, 1 << 20).since(Position(0, 0))) == kept[:6] + [kept[7]]
    assert [b.sequence for b in read_blocks(path)] == [0, 1, 2, 3, 4, 5, 7]


def test_journal_and_memory_stay_bounded(tmp_path):
    arrivals = [block(k, [0.1, 1.0 * (k % 7), 21.0]) for k in range(1200)]
    made = runtime(tmp_path, Listed(arrivals), Kept(), journal=60_000, pause=0.0)
    made.begin(True)
    sizes = []
    while not made.source.ended:
        made.once(0.0)
        sizes.append(made.journal.bytes)
    made.close()
    assert max(sizes) < 70_000
    assert sizes[-1] < max(sizes) or len(set(sizes[-300:])) > 1  # it is cut again and again
    assert 1200 * (sizes[1] - sizes[0]) > 2 * max(sizes)  # all together would be more
    assert read_checkpoint(tmp_path / "checkpoint.bin") is not None


def test_a_damaged_checkpoint_gives_way_to_the_one_before(tmp_path):
    path = tmp_path / "checkpoint.bin"
    for k in (1, 2):
        write_checkpoint(path, Checkpoint({"k": k}, bytes(range(200))))
    data = bytearray(path.read_bytes())
    data[60] ^= 1
    path.write_bytes(data)
    found = read_checkpoint(path)
    assert found is not None
    assert (found.told, found.engine) == ({"k": 1}, bytes(range(200)))


def test_a_checkpoint_that_is_gone_is_made_up_for_by_the_journal(tmp_path):
    arrivals = [block(k, [0.1, 1.0 * (k % 7), 21.0]) for k in range(200)]
    whole = run(tmp_path / "whole", Listed(arrivals)).intake.engine.saved()
    run(tmp_path / "a", Listed(arrivals[:150]))
    (tmp_path / "a" / "checkpoint.bin").unlink()
    assert run(tmp_path / "a", Listed(arrivals)).intake.engine.saved() == whole


def test_two_processes_cannot_share_a_state(tmp_path):
    first = runtime(tmp_path, Listed([]), Kept())
    with pytest.raises(TwinError, match="another process"):
        runtime(tmp_path, Listed([]), Kept())
    first.close()


def test_a_ring_gives_whole_blocks_or_none(tmp_path):
    sent = [block(k, [0.1, 1.0 * k, 21.0]) for k in range(10)]
    writer = RingWriter(tmp_path / "ring", slots=4, slot=1024)
    reader = RingReader(tmp_path / "ring")
    assert reader.next() is None or reader.newest() is None
    for one in sent:
        writer.write(one)
    assert reader.newest() == sent[9]
    assert [reader.read(7, k) for k in range(10)] == [None] * 6 + sent[6:]
    writer._map[64 + 1024 + 60] ^= 1  # a byte of block 9, in slot 1
    assert reader.newest() is None
    assert RingWriter(tmp_path / "ring", slots=4, slot=1024).next() == (7, 10)
    with pytest.raises(ValueError, match="bytes for slots"):
        writer.write(block(11, [0.1, 1.0, 21.0] * 100))


def test_a_file_that_comes_back_after_a_restart_is_not_taken_twice(spindle, state, tmp_path):
    lines = (RUN / "loads.csv").read_text().splitlines(keepends=True)
    grown = tmp_path / "loads.csv"
    out, options = [f"file:{tmp_path}/c.json"], LiveOptions(freeze="1 h")

    def until_records(wanted, write):
        made = wired(spindle, f"csv:{grown}", out, state, options)
        made.begin(False)
        made.once(0.05)
        write()
        for _ in range(100):
            if made.intake.records < wanted:
                made.once(0.1)
        made.close()
        return made.intake

    assert until_records(100, lambda: grown.write_text("".join(lines[:101]))).records == 100
    grown.unlink()
    again = until_records(150, lambda: grown.write_text("".join(lines[:151])))
    assert again.records == 150
    assert (again.timeline.leaps, again.timeline.last) == (0, 1490.0)


def test_the_journal_of_a_file_is_the_run_again(spindle, state, tmp_path):
    grown = tmp_path / "loads.csv"
    lines = (RUN / "loads.csv").read_text().splitlines(keepends=True)
    made = wired(spindle, f"csv:{grown}", [f"file:{tmp_path}/c.json"], state, LiveOptions())
    made.begin(False)
    for rows in (1, 2, 3, 30, 31, 100):
        grown.write_text("".join(lines[: rows + 1]))
        made.once(0.3)
    made.close()
    assert made.intake.records == 100
    assert command(["unpack", str(state / "journal" / "000000001.twb"), "-o", str(tmp_path / "again")]) == 0
    given, again = read_run(RUN).loads, read_run(tmp_path / "again").loads
    assert again.time.tolist() == given.time[:100].tolist()
    assert again.columns["x_position"] == pytest.approx(given.columns["x_position"][:100], rel=1e-14)


def test_a_column_that_loads_and_temperatures_share_is_taken_once_and_the_journal_can_be_read(tmp_path):
    (tmp_path / "loads.csv").write_text("time [s],air [degC],x_current [A]\n0,20,1\n10,20,2\n20,20,3\n")
    (tmp_path / "temperatures.csv").write_text("time [s],front [degC],air [degC]\n0,21,99\n10,22,99\n")
    (found,) = replay_of(tmp_path, 0.0).poll(1.0)
    assert isinstance(found, Block)
    assert found.names == ("air", "x_current", "front")
    assert list(found.values) == [20, 1, 21, 20, 2, 22, 20, 3, 22]
    journal = Journal(tmp_path / "journal", 1 << 20)
    journal.append(found)
    journal.close()
    assert list(Journal(tmp_path / "journal", 1 << 20).since(Position(0, 0))) == [found]
