"""Measured TCP errors beside the machine: what they teach, bad ones, and a process that was killed in between."""

from __future__ import annotations

import json
import math
import os
from array import array
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import twin
from tests.live.scripted import FACTS, Kept, Lag, Listed, block
from twin.cli.main import run as command
from twin.errors import TwinError
from twin.face.live import LiveOptions, live, wired
from twin.live.block import Block
from twin.live.clock import RecordClock
from twin.live.csv_source import replay_of
from twin.live.filter_gain import GainFilter
from twin.live.gate import limits_of
from twin.live.intake import Intake
from twin.live.learner import Learner
from twin.live.learning import Learning
from twin.live.limiter import Limits
from twin.live.offsets import neutral, offsets
from twin.live.publisher import Patience, Publisher
from twin.live.runtime import Keeping, Runtime
from twin.logs.read import read_run

MACHINE = Path(__file__).parents[1] / "machines" / "spindle"
HEAD = "time [s],x [mm],dx [um],dy [um],sigma [um],corrected [1]\n"
ALL = [block(k, (0.25, 8.0, 20.0)) for k in range(600)]  # 100 min


def runtime(folder: Path, source: Listed, events: Path) -> Runtime:
    sink = Kept()
    publisher = Publisher([sink], neutral(FACTS, "grid"), "grid", Limits(200e-6, 1e-6, 1.0), Patience(60.0, 600.0))
    learning = Learning(FACTS, Learner(FACTS, GainFilter(FACTS.all_poses)), events, folder)
    intake = Intake(Lag(), limits_of(FACTS, {}), None, True, learning)
    return Runtime(intake, source, publisher, RecordClock(), Keeping(folder, checkpoint=1200.0, pause=0.0))


def whole(made: Runtime) -> Runtime:
    made.begin(False)
    made.run(lambda: False)
    return made


def learnt(made: Runtime) -> dict:
    assert made.intake.learning is not None
    return made.intake.learning.health()


def row(minutes: float, dx: float, corrected: float = 0.0) -> str:
    return f"{1e9 + 60.0 * minutes!r},250,{dx!r},,1,{corrected:g}\n"


def test_a_machine_that_is_warmer_is_followed_as_by_twin_update(spindle, compiled, state, tmp_path):
    warmer = twin.load(MACHINE).edited({"sources.motor.gain": 1.4}, tmp_path / "warmer.toml")
    options = twin.SimulateOptions(tcp_every="5 min")
    twin.simulate(warmer, MACHINE / "runs" / "warm_up", output=tmp_path / "truth", options=options)
    expected = twin.update(spindle, tmp_path / "truth", twin.UpdateOptions(method="gain", slew="1 mm")).numbers
    made = live(spindle, f"replay:{tmp_path / 'truth'}", [f"file:{tmp_path / 'out.json'}"], state,
                LiveOptions(speed=0.0, events=tmp_path / "truth" / "tcp.csv",
                            initial=read_run(tmp_path / "truth").initial_temperature))  # fmt: skip
    assert learnt(made)["measurements"] == len(expected.row_time)
    moved = np.array(made.intake.errors()).reshape(-1, 3)
    corrected = expected.base[-1] + expected.correction[-1]
    assert np.abs(expected.correction[-1]).max() > 1e-6
    assert np.abs(moved - corrected).max() < 0.05 * np.abs(expected.correction[-1]).max()


def cut_up(block: Block, n: int = 3) -> Iterator[Block]:
    """The same rows as blocks of n."""
    for k in range(0, block.records, n):
        values = block.values[k * len(block.names) : (k + n) * len(block.names)]
        yield replace(block, sequence=k + n, time=block.time + k * block.interval, values=values)


@pytest.mark.long
def test_temperatures_and_r_tests_are_followed_as_by_the_filter_state_of_twin_update(spindle, tmp_path):
    warmer = twin.load(MACHINE).edited({"sources.motor.gain": 1.4}, tmp_path / "warmer.toml")
    options = twin.SimulateOptions(tcp_every="5 min")
    twin.simulate(warmer, MACHINE / "runs" / "warm_up", output=tmp_path / "truth", options=options)
    expected = twin.update(spindle, tmp_path / "truth", twin.UpdateOptions(method="state", slew="1 mm")).numbers
    given = LiveOptions(engine="jax", learn="state", speed=0.0, events=tmp_path / "truth" / "tcp.csv",
                        initial=read_run(tmp_path / "truth").initial_temperature)  # fmt: skip
    whole_run = replay_of(tmp_path / "truth", 0.0)
    parts = [part for found in whole_run.poll(1.0) if isinstance(found, Block) for part in cut_up(found)]

    def begun(folder: str) -> Runtime:
        place = f"replay:{tmp_path / 'truth'}"
        made = wired(spindle, place, [f"file:{tmp_path / 'out.json'}"], tmp_path / folder, given)
        made.keeping = Keeping(tmp_path / folder, checkpoint=1200.0, pause=0.0)
        made.source = Listed(parts, numbered=False)
        made.begin(False)
        return made

    made = begun("once")
    made.run(lambda: False)
    told = learnt(made)
    assert told["measurements"] == len(expected.row_time)
    assert told["learnt"]["readings"] > 100
    moved = np.array(made.intake.errors()).reshape(-1, 3)
    corrected = expected.base[-1] + expected.correction[-1]
    assert np.abs(expected.correction[-1]).max() > 1e-6
    assert np.abs(moved - corrected).max() < 0.05 * np.abs(expected.correction[-1]).max()

    cut = begun("cut")
    left, feed = [100], cut.intake.engine.feed

    def killed(times: array, rows: array) -> int:
        left[0] -= 1
        if not left[0]:
            raise KeyboardInterrupt
        return feed(times, rows)

    cut.intake.engine.feed = killed
    with pytest.raises(KeyboardInterrupt):
        cut.run(lambda: False)
    again = begun("cut")
    again.run(lambda: False)
    assert again.taken_again > 0
    assert again.intake.engine.steps == made.intake.engine.steps
    assert again.intake.errors() == made.intake.errors()
    assert learnt(again)["learnt"] == told["learnt"]


def test_a_process_that_was_killed_learns_the_same(tmp_path):
    events = tmp_path / "tcp.csv"
    events.write_text(HEAD + "".join(row(t, 3.0 + 0.01 * t) for t in (10.5, 31, 49.5, 80)))
    once = whole(runtime(tmp_path / "once", Listed(ALL), events))
    assert learnt(once)["measurements"] == 4
    for cut in (200, 250, 305):  # no checkpoint there
        state = tmp_path / f"state{cut}"
        first = runtime(state, Listed(ALL[:cut]), events)
        first.begin(False)
        while not first.source.ended:
            first.once(0.0)
        first.journal.sync()
        os.close(first._lock)  # as the kernel does
        again = whole(runtime(state, Listed(ALL), events))
        assert again.taken_again > 0
        assert again.intake.errors() == once.intake.errors()
        assert learnt(again)["learnt"] == learnt(once)["learnt"]
        assert learnt(again)["measurements"] == 4


def test_bad_rows_and_files_are_counted_and_change_nothing(tmp_path):
    folder = tmp_path / "events"
    folder.mkdir()
    sound = row(40, 5.0)
    (folder / "a.csv").write_text(
        HEAD + "x\n" + row(30, math.nan) + row(30, 5e6) + "1e9,nan,1,1,1,0\n" + "nan,1,1,1,1,0\n" + sound
    )
    (folder / "b.csv").write_text("time [s],dx [um]\n1,2\n")
    (folder / "c.csv").write_bytes(b"\x00\xff" * 50 + b"\n" + b"\x00\n")
    (folder / "d.csv").write_text(HEAD + sound + row(1e4, 5.0))  # once more, and one that is still to come
    (folder / "e.txt").write_text("not looked at")
    made = whole(runtime(tmp_path / "state", Listed(ALL), folder))
    told = learnt(made)
    assert (told["measurements"], told["rows_wrong"], told["waiting"]) == (1, 5, 1)
    assert "no columns" in told["error"] or "header" in told["error"]
    alone = tmp_path / "alone.csv"
    alone.write_text(HEAD + sound)
    assert made.intake.errors() == whole(runtime(tmp_path / "b", Listed(ALL), alone)).intake.errors()


def test_one_that_comes_too_late_is_left_out_and_one_that_lies_is_gated(tmp_path):
    events = tmp_path / "tcp.csv"
    events.write_text(HEAD)
    made = runtime(tmp_path / "state", Listed(ALL), events)
    made.begin(False)
    for k in range(300):
        made.once(0.0)
        if k == 270:
            with events.open("a") as f:
                f.write(row(5, 3.0) + row(44, 3.0) + row(44.5, 900.0))
    told = learnt(made)
    assert (told["too_old"], told["measurements"]) == (1, 2)
    assert [t["accepted"] for t in told["last"]] == [False]
    assert max(map(abs, made.intake.errors())) < 20e-6
    made.close()


def test_what_was_measured_with_offsets_active_is_freed_of_them(tmp_path):
    events = tmp_path / "tcp.csv"
    events.write_text(HEAD)
    made = runtime(tmp_path / "state", Listed(ALL), events)
    made.begin(False)
    for k in range(600):
        made.once(0.0)
        if k == 400:  # the tool stands where it should: the offsets are right, so nothing is to be learnt
            with events.open("a") as f:
                f.write(row(66, 0.0, corrected=1.0))
    gain, slow, offset = learnt(made)["learnt"]["dx"]
    assert made.publisher.outlets[0].now[0][1] == pytest.approx(
        offsets(FACTS, made.intake.errors(), "grid")[0][1], abs=1e-7
    )
    assert max(map(abs, made.publisher.outlets[0].now[0])) > 1e-6
    assert (gain, slow, 1e6 * offset) == pytest.approx((1.0, 0.0, 0.0), abs=0.05)
    made.close()


@pytest.mark.long
def test_no_place_is_refused(tmp_path, capsys, spindle):
    with pytest.raises(TwinError, match="no file and no folder"):
        Learning(FACTS, Learner(FACTS, GainFilter(FACTS.all_poses)), tmp_path / "none", tmp_path)
    told = ["--source", f"replay:{MACHINE / 'runs' / 'warm_up'}", "--out", "file:o.json", "--speed", "0"]
    assert command(["live", str(spindle), *told, "--state", str(tmp_path / "s"), "--events", str(tmp_path / "x")]) == 2
    assert "no file and no folder" in capsys.readouterr().err


def test_the_health_record_says_what_was_learnt(tmp_path):
    events = tmp_path / "tcp.csv"
    events.write_text(HEAD + row(20, 4.0))
    whole(runtime(tmp_path / "state", Listed(ALL), events))
    told = json.loads((tmp_path / "state" / "health.json").read_text())["learnt"]
    assert told["measurements"] == 1
    lines = [json.loads(line) for line in (tmp_path / "state" / "events.jsonl").read_text().splitlines()]
    (measured,) = [line["measured"] for line in lines if "measured" in line]
    assert measured["position_m"] == [0.25]
    assert measured["learnt"][0]["name"] == "dx"


@pytest.mark.slow
def test_a_state_of_one_filter_is_refused_by_the_other_and_the_filter_state_begins_first(spindle, tmp_path, capsys):
    given = ["live", str(spindle), "--source", f"replay:{MACHINE / 'runs' / 'warm_up'}", "--speed", "0", "--out",
             f"file:{tmp_path / 'o.json'}", "--engine", "jax", "--state"]  # fmt: skip
    events = tmp_path / "tcp.csv"
    events.write_text(HEAD)
    gain, state, none = (str(tmp_path / name) for name in ("gain", "state", "none"))
    assert command([*given, gain, "--events", str(events)]) == 0
    assert command([*given, gain, "--learn", "state"]) == 2
    assert "of another way to learn" in capsys.readouterr().err
    assert command([*given, state, "--learn", "state"]) == 0
    assert command([*given, state, "--events", str(events)]) == 2
    assert "of another way to learn" in capsys.readouterr().err
    lines = (MACHINE / "runs" / "warm_up" / "loads.csv").read_text().splitlines(keepends=True)
    (tmp_path / "loads.csv").write_text("".join(lines[:100]))
    given[3] = f"replay:{tmp_path}"
    assert command([*given, none]) == 0
    (tmp_path / "loads.csv").write_text("".join(lines))
    assert command([*given, none, "--learn", "state"]) == 2
    assert "running before the filter state began" in capsys.readouterr().err
