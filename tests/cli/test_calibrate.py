"""twin calibrate on the command line."""

import json
import re
from dataclasses import replace

import h5py
import pytest

from tests.calibrate import lumped_case
from twin.calibrate.channels.table import channel_lines
from twin.cli.main import run as twin
from twin.logs.write import write_run
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact, write_artefact
from twin.rom.content import stamp


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A.h5 and a run whose bearing losses are 30 % higher than described."""
    place = tmp_path_factory.mktemp("calibrate")
    a = lumped_case.artefact()
    write_artefact(
        place / "A.h5", a.model, a.description, {"step": 60.0, "substeps": 4}, a.provenance, parameters=a.parameters
    )
    gains = {p.path: 1.3 * p.nominal for p in a.parameters if p.kind == "source"}
    write_run(place / "truth", lumped_case.truth(gains, 5))
    write_run(place / "again", lumped_case.truth(gains, 6))
    return place


@pytest.fixture(scope="module")
def calibrated(folder):
    """B.h5, with its report and the edited description."""
    B, edited = folder / "B.h5", folder / "edited.toml"
    status = twin(
        ["calibrate", str(folder / "A.h5"), str(folder / "truth"), "-o", str(B), *OPTIONS, "--machine", str(edited)]
    )
    assert status == 0
    return B


OPTIONS = ("--only", "sources.*", "--noise", "0.05 K", "--form", "0.01")


@pytest.mark.long
def test_writes_the_artefact_the_report_and_the_description(folder, calibrated, capsys):
    A, B, edited = folder / "A.h5", calibrated, folder / "edited.toml"
    report = json.loads((folder / "B.json").read_text(encoding="utf-8"))
    assert report["stopped"] == "minimum"
    for row in report["parameters"]:
        if row["learned"] > 0.9:
            assert row["value"] == pytest.approx(1.3 * row["nominal"], abs=4 * row["sigma"]), row
    assert max(row["learned"] for row in report["parameters"]) > 0.9
    assert (folder / "B.png").read_bytes()[:4] == b"\x89PNG"
    b = read_artefact(B)
    described = load_machine(lumped_case.FOLDER, edited.read_text(encoding="utf-8"))
    for source in b.model.load_model.sources:
        assert source.gain == pytest.approx(described.sources[source.name].gain, rel=1e-5)
        fitted = next(r for r in report["parameters"] if r["path"] == f"sources.{source.name}.gain")
        assert source.gain == pytest.approx(fitted["value"], rel=1e-9)
    assert "calibrated:" in edited.read_text(encoding="utf-8")
    assert b.provenance["calibrated_from"] == read_artefact(A).digest
    assert "before calibration" in b.certificate["holds_for"]
    # and it goes on: a second calibration starts from the fitted values
    before = B.read_bytes()
    assert twin(["calibrate", str(B), str(folder / "truth"), "-o", str(folder / "C.h5"), *OPTIONS, "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert B.read_bytes() == before  # the model it starts from stays
    assert max(abs(row["pull"]) for row in again["parameters"] if row["learned"] > 0.9) < 0.5


@pytest.mark.slow
def test_a_calibrated_artefact_is_verified_against_its_own_description(calibrated, capsys):
    assert twin(["verify", str(calibrated)]) == 0  # a lumped machine's artefact is exact
    assert "holds_for" not in read_artefact(calibrated).certificate
    capsys.readouterr()


@pytest.mark.long
def test_windows_tell_where_they_are(folder, capsys):
    status = twin(
        ["calibrate", str(folder / "A.h5"), str(folder / "truth"), "-o", str(folder / "W.h5"), *OPTIONS,
         "--window", "30 min", "--every", "30 min"]
    )  # fmt: skip
    out = capsys.readouterr().out
    assert status == 0
    assert re.findall(r"^(\d\.\d) h: ", out, re.MULTILINE)[:2] == ["0.5", "1.0"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--only", "sources.spindel*"), "matches no parameter"),
        (("--noise", "0 K"), "positive"),
        (("--exclude", "nose"), "no sensor 'nose'"),
        (("--window", "1 h", "again"), "sliding windows go through one run"),
        (("--window", "1 h", "--every", "10 h"), "the run covers"),
        (("truth",), "a run is given twice"),
        (("--form", "nan"), "out of range"),
        (("--machine", "A.h5"), "ends with .toml"),
        (("--budget", "5 K"), "--budget"),
    ],
)
def test_bad_input_is_one_clear_error(folder, capsys, arguments, told):
    more = [str(folder / a) if a in ("again", "truth") else a for a in arguments]
    target = folder / "never.h5"
    status = twin(["calibrate", str(folder / "A.h5"), str(folder / "truth"), "-o", str(target), *more])
    err = capsys.readouterr().err
    assert status == 2
    assert told in err
    assert "Traceback" not in err
    assert not target.exists()


@pytest.mark.parametrize(
    ("target", "told"),
    [
        ("A.h5", "would replace the artefact"),
        ("truth/loads.csv", "ends with .h5"),
        ("truth/B.h5", "is a run folder"),
    ],
)
def test_nothing_that_was_there_is_replaced(folder, capsys, target, told):
    before = {p: p.read_bytes() for p in (folder / "A.h5", folder / "truth" / "loads.csv")}
    assert twin(["calibrate", str(folder / "A.h5"), str(folder / "truth"), "-o", str(folder / target)]) == 2
    assert told in capsys.readouterr().err
    assert {p: p.read_bytes() for p in before} == before


@pytest.mark.slow
def test_windows_without_an_r_test_and_rows_without_a_place(folder, tmp_path, capsys):
    run = lumped_case.truth({}, 7)
    position = run.tcp.position.copy()
    position[0] = float("nan")
    write_run(tmp_path / "run", replace(run, tcp=replace(run.tcp, position=position)))
    status = twin(
        ["calibrate", str(folder / "A.h5"), str(tmp_path / "run"), "-o", str(tmp_path / "W.h5"), *OPTIONS,
         "--window", "10 min", "--every", "30 min"]
    )  # fmt: skip
    assert status == 0
    assert twin(["calibrate", str(folder / "A.h5"), str(tmp_path / "run"), "-o", str(tmp_path / "X.h5"), *OPTIONS]) == 0
    assert "1 rows of tcp.csv" in capsys.readouterr().out


def test_an_old_artefact_without_parameters_says_what_to_do(folder, tmp_path, capsys):
    a = lumped_case.artefact()
    old = tmp_path / "old.h5"
    bare = replace(
        a.model,
        bodies=tuple(replace(b, members=(), E_members=None, G_members=None, W_members=None) for b in a.model.bodies),
    )
    write_artefact(old, bare, a.description, {"step": 60.0}, a.provenance)
    with h5py.File(old, "a") as f:
        del f["parameters"]
        stamp(f)
    assert twin(["calibrate", str(old), str(folder / "truth"), "-o", str(tmp_path / "B.h5")]) == 2
    assert "build it again" in capsys.readouterr().err


def test_channels_of_a_machine_without_sensors_are_its_displacements():
    row = {"run": "monday", "channel": "dx", "unit": "m", "rms": 2e-6, "kept": 1.0}
    (_, head, line) = channel_lines([row], 5)
    assert head.startswith("channel")
    assert line.split()[:4] == ["dx", "monday", "2.00", "um"]
    assert channel_lines([row | {"rms": None}], 5) == []
