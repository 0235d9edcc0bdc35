"""What the process says: drift that names the sensor, outputs that go on, errors with a remedy."""

from __future__ import annotations

import json
import os
from array import array
from dataclasses import replace
from pathlib import Path

import pytest

from tests.live.scripted import FACTS, NAMES, UNITS, Kept, Listed, block, run, runtime
from twin.cli.main import run as command
from twin.errors import TwinError
from twin.live.channels import read_channels
from twin.live.drift import Drift
from twin.live.sinks import FileSink, RingSink, Sent


def readings(hours, off):
    """Blocks with three sensors beside the loads; off(k) -> what each reads besides 21 degC."""
    names, units = (*NAMES, "front", "back", "screw"), (*UNITS, "degC", "degC", "degC")
    for k in range(round(hours * 360)):
        values = array("d", [0.1, 0.0, 21.0, *(21.0 + v for v in off(k / 360.0))])
        yield block(k, values, names=names, units=units)


def test_a_sensor_that_drifts_is_named_and_no_other(tmp_path):
    def off(hour):
        return 0.0, max(hour - 3.0, 0.0), 0.0

    made = run(tmp_path, Listed(list(readings(7.0, off))))
    told = made.health()
    assert len(told["drift"]) == 1
    assert "sensor back reads +" in told["drift"][0]
    assert told["trust"].startswith("with care: sensor back")
    assert set(told["sensors"]) == {"front", "back", "screw"}


def test_a_machine_that_the_model_gets_wrong_is_no_drift(tmp_path):
    made = run(tmp_path, Listed(list(readings(7.0, lambda hour: [max(hour - 3.0, 0.0)] * 3))))
    assert made.health()["drift"] == []


def test_single_spikes_of_a_sensor_move_nothing():
    drift = Drift()
    for k in range(400):
        drift.take({s: 85.0 if s == "a" and k % 20 == 3 else 20.0 for s in "abc"}, dict.fromkeys("abc", 20.0), 60.0)
    assert drift.alarms() == []
    assert drift.of["a"].mean == 0.0


@pytest.mark.parametrize(("kind", "form"), [("file", "grid"), ("file", "polynomial"), ("ring", "grid")])
def test_an_output_goes_on_from_what_stands_there(kind, form, tmp_path):
    def sink():
        return (FileSink if kind == "file" else RingSink)(FACTS, form, tmp_path / "out")

    values = ((1e-6, -2e-6, 3e-6),)
    first = sink()
    assert first.last() is None
    first.write(Sent(1, 1e9, 1e9 + 5.0, "following", "follows the model", values))
    first.close()
    again = sink()
    assert again.last() == values
    again.close()


def test_a_file_of_another_artefact_is_not_gone_on_from(tmp_path):
    FileSink(FACTS, "grid", tmp_path / "o").write(Sent(1, 0.0, 5.0, "following", "", ((1e-6, 0.0, 0.0),)))
    assert FileSink(replace(FACTS, digest="e" * 64), "grid", tmp_path / "o").last() is None
    assert FileSink(FACTS, "polynomial", tmp_path / "o").last() is None


def test_a_state_of_another_artefact_is_refused(tmp_path):
    run(tmp_path, Listed([block(k, [0.1, 5.0, 21.0]) for k in range(30)]))
    made = runtime(tmp_path, Listed([]), Kept())
    made.intake.engine.facts = replace(FACTS, digest="e" * 64)
    with pytest.raises(TwinError, match="of another artefact"):
        made.begin(False)
    made.begin(True)
    assert made.taken_again == 0
    made.close()


def test_the_health_record_is_plain_json_and_bounded(tmp_path):
    run(tmp_path, Listed([block(k, [0.1, 5.0, 21.0]) for k in range(30)]))
    told = json.loads((tmp_path / "health.json").read_text())
    assert told["model"]["steps"] == 4
    assert {"age_s", "blocks", "gaps", "values_refused"} <= set(told["input"])
    events = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text().splitlines()]
    assert "following" in [e["mode"] for e in events]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[channels.nobody]\nlow = 1", "no channel 'nobody'"),
        ("[channels.air]\nlow = '1 mm'", "low"),
        ("[channels.air]\nlower = 1", "unknown keys: lower"),
        ("[channels.air]\nnode = 'n'\nunit = 'mm'", "not of degC"),
        ("[channel", "not valid TOML"),
        ("channels = 3", "channels is no table"),
        ("[channels]\nair = 3", "channels.air is no table"),
        ("[channels.air]\nlow = 30\nhigh = 10", "low is not below high"),
        ("[opcua]\nuser = 'twin'", "user without password_file"),
        ("[opcua]\ncertificate = 'c.der'", "certificate without key"),
        ("[opcua]\ninterval = '0 s'", "interval"),
        ("[mqtt]\nclient = 3", "client is no text"),
    ],
)
def test_a_bad_channels_file_is_refused(text, says, tmp_path):
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(TwinError, match=says):
        read_channels(tmp_path / "c.toml", FACTS)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--source", "tape:x", "--out", "file:o"], "no source 'tape'"),
        (["--source", "replay:nowhere", "--out", "file:o"], "no such file"),
        (["--source", "csv:x", "--out", "paper"], "names no output"),
        (["--source", "csv:x", "--out", "file:o", "--limit", "3 kg"], "--limit"),
        (["--source", "csv:x", "--out", "file:o", "--speed", "-1"], "--speed"),
        (["--source", "csv:x", "--out", "file:pipe"], "is a pipe or device"),
        (["--source", "csv:x", "--out", "ring:pipe"], "is a pipe or device"),
        (["--source", "csv:x", "--out", "file:o", "--learn", "state"], "add --engine jax"),
        (["--source", "csv:x", "--out", "file:o", "--learn", "gain"], "name them with --events"),
    ],
)
def test_bad_options_are_one_error(more, says, spindle, state, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")  # stands for a device such as /dev/null, which a rename would replace
    assert command(["live", str(spindle), "--state", str(state), *more]) == 2
    assert says in capsys.readouterr().err
    assert Path("pipe").is_fifo()
    assert not (tmp_path / "o").exists()


def test_what_is_no_artefact_is_refused(tmp_path, capsys):
    (tmp_path / "a.h5").write_text("no")
    assert command(["live", str(tmp_path / "a.h5"), "--source", "csv:x", "--out", f"file:{tmp_path}/o", "--state",
                    str(tmp_path / "s")]) == 2  # fmt: skip
    assert "remedy" in capsys.readouterr().err
