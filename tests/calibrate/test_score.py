"""`twin score` on a machine whose runs another machine measured: figures, parts, segments, files, mistakes."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import synthetic
import synthetic_run

from twin.calibrate.score.score import HOLD_FIRST, MODEL, VECTOR, Settings, score
from twin.cli.score import command
from twin.errors import TwinError
from twin.logs.run import Run, Segment, Table, Tcp
from twin.logs.write import write_run
from twin.rom.artefact import Artefact, read_artefact
from twin.run.replay import replay

pytestmark = pytest.mark.long

MODEL_MACHINE = synthetic.machine()
OFFSET = 0.5  # K, of sensor T01
GAIN = 1.25  # of the measured TCP error


def measured_run(artefact: Artefact, seed: int, hours: float = 3.0, every: int = 8) -> Run:
    """The truth: another machine, whose sensor T01 sits elsewhere and whose structure expands more."""
    time, signals = synthetic.loads(MODEL_MACHINE.load_model, hours, seed=seed)
    columns = {s.column: signals[s.name] for s in MODEL_MACHINE.load_model.signals}
    units = {s.column: s.unit for s in MODEL_MACHINE.load_model.signals}
    run = Run(Table(time, columns, units), synthetic=("loads",))
    result = replay(artefact, run)
    temperature = result.temperature.copy()
    temperature[1:, result.sensors.index("T01")] += OFFSET
    sensors = dict(zip(result.sensors, temperature.T, strict=True))
    rows = np.arange(0, len(result.time), every)
    pose = np.where(np.arange(len(rows)) % 2, 4, 8)
    tcp = Tcp(result.time[rows], ("x", "y"), MODEL_MACHINE.poses[pose], GAIN * result.tcp[rows, pose])
    table = Table(result.time, sensors, dict.fromkeys(sensors, "degC"))
    return replace(run, temperatures=table, tcp=tcp)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return synthetic_run.artefact(tmp_path_factory.mktemp("score") / "a.h5", MODEL_MACHINE)


@pytest.fixture(scope="module")
def artefact(path):
    return read_artefact(path)


@pytest.fixture(scope="module")
def runs(artefact):
    return [measured_run(artefact, seed) for seed in (1, 2, 3)]


@pytest.fixture(scope="module")
def folders(runs, tmp_path_factory):
    made = [tmp_path_factory.mktemp("runs") / name for name in ("one", "two", "three")]
    for folder, run in zip(made, runs, strict=True):
        write_run(folder, run)
    return [str(f) for f in made]


@pytest.fixture(scope="module")
def found(artefact, runs):
    one = replace(runs[0], segments=(Segment("early", 0.0, 3600.0), Segment("late", 3600.0, 8000.0)))
    return score(artefact, [("one", one)], [("two", runs[1])], [("three", runs[2])])


def figure(found, part, run, segment, output, method):
    (entry,) = [
        e
        for e in found.entries
        if (e.part, e.run, e.segment, e.output, e.method) == (part, run, segment, output, method)
    ]
    return entry.figures


def test_temperatures_are_scored_against_holding_the_first(found):
    off, right = figure(found, "scored", "", "", "T01", MODEL), figure(found, "scored", "", "", "T02", MODEL)
    assert off.max_abs == pytest.approx(OFFSET)
    assert right.rms < 1e-9
    assert right.share == pytest.approx(1.0)
    held = figure(found, "scored", "", "", "T01", HOLD_FIRST)
    assert held.share == pytest.approx(0.0)
    assert off.share == pytest.approx(1.0 - off.rms / held.rms)
    assert off.percent_of_max == pytest.approx(100.0 * off.max_abs / held.max_abs)
    assert found.air == ("T_hall",)
    assert "T_hall" not in {e.output for e in found.entries}


def test_tcp_share_and_parts(found, runs):
    """The truth is 1.25 times the model at any pose: 80 % computed, in every segment and pooled, scored or sealed."""
    for at in (("scored", "one", "early"), ("scored", "one", "late"), ("scored", "", ""), ("sealed", "", "")):
        told = figure(found, *at, VECTOR, MODEL)
        assert told.share == pytest.approx(1.0 / GAIN)
        assert figure(found, *at, VECTOR, "zero").rms == pytest.approx(told.measured_rms)
    early, late = (figure(found, "scored", "one", s, VECTOR, MODEL) for s in ("early", "late"))
    pooled = figure(found, "scored", "", "", VECTOR, MODEL)
    assert pooled.n == early.n + late.n == np.sum(runs[0].tcp.time <= 8000.0)  # one at 3600 s is in one of them
    assert pooled.rms**2 * pooled.n == pytest.approx(early.rms**2 * early.n + late.rms**2 * late.n)
    assert {r.part for r in found.runs} == {"scored", "sealed", "train"}
    assert not [e for e in found.entries if e.part == "train"]
    (one,) = [r for r in found.runs if r.run == "one"]
    assert one.outside_segments == np.sum(runs[0].tcp.time > 8000.0)


def test_the_difference_is_to_the_best_baseline(found):
    for part in ("scored", "sealed"):
        rms = {m: figure(found, part, "", "", VECTOR, m).rms for m in ("zero", "hold last", "regression", "ARX", "OE")}
        assert min(rms, key=rms.get) == found.best[part]
        difference = found.difference[part]
        assert difference.value == pytest.approx(figure(found, part, "", "", VECTOR, MODEL).rms - rms[found.best[part]])
        assert rms["regression"] < rms["zero"]


def test_a_run_scores_the_same_whatever_stands_beside_it(artefact, runs, found):
    alone = score(artefact, [("two", runs[1])], train=[("three", runs[2])])
    for method in (MODEL, "hold last", "regression", "OE"):
        assert figure(alone, "scored", "", "", VECTOR, method) == figure(found, "sealed", "", "", VECTOR, method)


def test_segments_may_start_anew(artefact):
    """Two tests put into one log without the cooling between: as one they are wrong, each by itself is right."""
    parts = [measured_run(artefact, seed, hours=1.0) for seed in (4, 5)]
    gap = parts[0].loads.time[-1] + 60.0

    def joined(tables):
        time = np.concatenate([tables[0].time, tables[1].time + gap])
        return Table(
            time, {k: np.concatenate([t.columns[k] for t in tables]) for k in tables[0].columns}, tables[0].units
        )

    segments = (Segment("first", 0.0, gap - 1.0), Segment("second", gap, gap + 3600.0))
    glued = Run(joined([p.loads for p in parts]), joined([p.temperatures for p in parts]), segments=segments)
    wrong = score(artefact, [("glued", glued)])
    right = score(artefact, [("glued", glued)], settings=Settings(restart=True))
    assert figure(right, "scored", "glued", "second", "T02", MODEL).rms < 1e-4
    assert figure(wrong, "scored", "glued", "second", "T02", MODEL).rms > 0.1
    assert figure(wrong, "scored", "glued", "first", "T02", MODEL).rms < 0.01


def test_command_writes_every_figure(path, folders, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = [str(path), folders[0], "--sealed", folders[1], "--train", folders[2], "-o", str(out)]
    command.main(arguments, standalone_mode=False)
    text = capsys.readouterr().out
    for word in ("sealed run", "T01", "hold last", "regression", "OE", "share %", "the best baseline", "T_hall"):
        assert word in text
    told = json.loads((out / "score.json").read_text())
    with open(out / "score.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(told["figures"])
    for row, entry in zip(rows, told["figures"], strict=True):
        assert float(row["rms"]) == entry["rms"]
        assert (row["share"] == "") == (entry["share"] is None)
    assert told["model_minus_best_baseline"]["scored"]["block_rows"] >= 1
    assert told["baselines"]["regression"] == "fitted to 1 training run"
    assert (out / "channels.png").read_bytes()[:4] == b"\x89PNG"
    by_channel = {(r["run"], r["channel"]): r for r in told["channels"]}
    for run in map(Path, folders[:2]):
        entry = by_channel[run.name, "T01"]
        assert entry["kept"] == 1.0
        assert entry["wrong"] == ""
        assert 0.0 < entry["rms"] < 10.0
        assert (run.name, "dx") in by_channel
    command.main([*arguments[:-2], "--json"], standalone_mode=False)
    assert json.loads(capsys.readouterr().out) == told


def test_mistakes_are_told(path, folders, tmp_path, runs):
    def fails(*arguments):
        with pytest.raises(TwinError) as caught:
            command.main([str(path), *arguments], standalone_mode=False)
        return str(caught.value)

    assert "given twice" in fails(folders[0], "--train", folders[0])
    assert "no segments" in fails(folders[0], "--restart")
    assert "run folder" in fails(folders[0], "-o", folders[1])
    assert "T00" in fails(folders[0], "--inputs", "T0O")
    bare = tmp_path / "bare"
    write_run(bare, replace(runs[0], temperatures=None, tcp=None))
    assert "nothing measured" in fails(str(bare))
