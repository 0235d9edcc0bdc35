"""Two nodes that an oil line joins, and a joint that conducts more the faster something turns: other paths of heat."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnose import small_case
from tests.diagnose.test_lumped import MACHINE, loads, twin
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.extend import write_extension
from twin.diagnose.faults.acted import slots_with, units_of
from twin.diagnose.faults.missing_joint import pairs
from twin.diagnose.faults.paths import Paths, paths_of
from twin.diagnose.faults.table import family_of
from twin.diagnose.model.bank import nominal_run, respond
from twin.diagnose.pipeline import Result, Settings, diagnose
from twin.diagnose.search.forward import search
from twin.diagnose.search.paths import otherwise
from twin.errors import DescriptionError
from twin.logs.read import read_run
from twin.logs.write import write_run
from twin.machine.effects.edits import extended_description
from twin.machine.effects.effect import Effect
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact

SEEDS = (0, 4, 6)
LINE, FASTER = 4.0, 4.0  # W/K; times the conductance at the top speed


@pytest.fixture(scope="module")
def artefact(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("four") / "four.h5"
    twin("build", MACHINE, "-o", path)
    return path


def diagnosed(artefact: Path, real: Path, logs: list[Path], out: Path) -> Result:
    """Two days of a real machine, and one that is sealed."""
    runs = []
    for seed, log in zip(SEEDS, logs, strict=True):
        noise = ("--noise", "0.1 K", "--tcp-noise", "1 um", "--seed", seed)
        twin("simulate", real, log, "-o", out / f"measured_{seed}", *noise)
        run = read_run(out / f"measured_{seed}")
        columns = {name: values for name, values in run.loads.columns.items() if name != "hidden_1"}
        runs.append(replace(run, loads=replace(run.loads, columns=columns)))
    machine = load_machine(MACHINE)
    return diagnose(read_artefact(artefact), machine, runs[:2], runs[2:], Settings(nulls=40, form=32))


@pytest.mark.long
def test_a_line_between_two_nodes_is_named_and_written(artefact: Path, tmp_path: Path) -> None:
    """It warms the bed with what the motor has: to first order the motor's heat enters there, or another one's does."""
    twin("hide", "missing_joint", "motor<>bed", f"{LINE:g} W/K", MACHINE, "-o", tmp_path / "real")
    logs = [loads(tmp_path / f"{seed}", seed) for seed in SEEDS]
    result = diagnosed(artefact, tmp_path / "real", logs, tmp_path)
    (cause,) = result.diagnosis.causes
    assert (result.diagnosis.verdict, cause.family, cause.place) == ("named", "missing_joint", "motor<>bed")
    assert cause.ci95[0] < LINE < cause.ci95[1] < 4.0 * LINE
    (gain,) = (g for g in result.diagnosis.gain if g.channel == "bed")
    assert gain.extended < 0.5 * gain.recalibrated
    runs = [read_run(log) for log in logs[:2]]
    machine = load_machine(MACHINE)
    diagnosis, said = write_extension(result, read_artefact(artefact), machine, runs, tmp_path / "diagnosis")
    assert said == [f"description with the cause: {tmp_path / 'diagnosis' / 'machine.toml'}"]
    joint = load_machine(tmp_path / "diagnosis").contacts["found_1"]
    assert (joint.surfaces, joint.total) == (("motor", "bed"), pytest.approx(cause.amplitude, rel=1e-4))
    assert diagnosis.causes[0].parameter == "contacts.found_1.total"


@pytest.mark.long
def test_a_joint_that_conducts_with_a_speed_is_named_with_it(artefact: Path, tmp_path: Path) -> None:
    """It cools the motor while that turns, as wind would."""
    logs = [loads(tmp_path / f"{seed}", seed) for seed in SEEDS]
    named = [word for log in logs for word in ("--run", log)]
    twin("hide", "joint", "contacts.flange", FASTER, MACHINE, "-o", tmp_path / "real", "--to", "1 h", *named)
    hidden = [tmp_path / "real" / "runs" / log.name for log in logs]
    for log in hidden:
        run = read_run(log)
        switch = run.loads.columns["speed"] / max(run.loads.columns["speed"])
        write_run(log, replace(run, loads=replace(run.loads, columns={**run.loads.columns, "hidden_1": switch})))
    result = diagnosed(artefact, tmp_path / "real", hidden, tmp_path)
    (cause,) = result.diagnosis.causes
    assert (result.diagnosis.verdict, cause.family, cause.place) == ("named", "joint", "contacts.flange")
    assert (cause.signal, cause.exponent) == ("speed", 1.0)
    assert cause.ci95[0] < FASTER < cause.ci95[1]
    entry = family_of(cause.family)
    assert entry is not None
    edit = entry.edit(cause, result.search.detector.study)
    with pytest.raises(DescriptionError, match="no switch"):  # it is named, and not written
        extended_description(read_artefact(artefact).description, [edit])


def test_paths_are_asked_where_anything_is_out_of_order_and_only_there(monkeypatch: pytest.MonkeyPatch) -> None:
    study, detector = small_case.study(), small_case.made_detector()
    y = np.concatenate([study.outputs(k, np.zeros(len(study.scale))) for k in study.fitted])
    sound = search(detector, y)
    asked: list[int] = []
    monkeypatch.setattr(sys.modules[otherwise.__module__], "paths_of", lambda *of: asked.append(1) or Paths((), (), ()))
    monkeypatch.setattr(sys.modules[otherwise.__module__], "_with", lambda detector, *_: (detector, []))
    assert otherwise(sound, y) is sound
    assert not asked
    assert otherwise(sound, y, more=True) is sound
    loose = replace(sound, loose=(Loose(0, 3.0, 0.1, 2.0),))
    assert otherwise(loose, y) is loose
    assert len(asked) == 2


def test_only_parts_that_no_contact_joins_may_be_joined() -> None:
    study = small_case.study()
    places = study.probed.places
    found = [{places[i].name, places[j].name} for i, j in pairs(study)]
    assert found
    assert not any(frozenset(pair) in study.probed.joined for pair in found)


@pytest.mark.parametrize(
    ("place", "what"),
    [
        ("motor", "needs two places"),
        ("motor<>head", "contacts.flange joins them already"),
        ("motor<>nowhere", "no such surface"),
        ("motor<>motor", "both ends are at one node"),
    ],
)
def test_a_missing_joint_needs_two_nodes(place: str, what: str) -> None:
    text = (MACHINE / "machine.toml").read_text("utf-8")
    with pytest.raises(DescriptionError, match=what):
        extended_description(text, [Effect("missing_joint", place, 2.0, "W/K", "always")])


@pytest.mark.long
def test_responses_of_paths_against_differences() -> None:
    """On the machine whose laws read no temperature, where responses leave out nothing."""
    study, elements = small_case.study(linear=True), small_case.elements(linear=True)
    nominal = [nominal_run(study, k) for k in study.fitted]
    own, x = paths_of(study, nominal, 0), np.zeros(len(study.probed.parameters))
    D = respond(study, nominal, own.vectors, own.columns)
    assert {b.kind for b in own.batches} == {"between", "joint", "contact"}
    strong = next(b for b in own.batches if b.kind == "between")
    for when, column in zip(strong.histories[1:], strong.columns[0][1:], strict=True):
        size = own.columns[column].across
        h, parts = Hypothesis(strong, 0, when, 0.0, (size,)), []
        for k in study.fitted:
            slots = slots_with(study, elements, units_of(study, h), k)
            parts.append(study.outputs(k, x, slots, [size]) - study.outputs(k, x))
        got, wanted = size * D[:, strong.columns[0]] @ when.weights[0], np.concatenate(parts)
        assert np.linalg.norm(got - wanted) < 0.03 * np.linalg.norm(wanted)
    for batch in own.batches:
        little = 2e-3 if batch.kind == "between" else 5e-3  # W/K; of a conductance
        when = batch.histories[0 if batch.kind == "between" else -1]
        h = Hypothesis(batch, 0, when, 0.0, (0.0,))
        got = D[:, batch.columns[0]] @ h.when.weights[0]
        parts = []
        for k in study.fitted:
            slots = slots_with(study, elements, units_of(study, h), k)
            parts.append((study.outputs(k, x, slots, [little]) - study.outputs(k, x, slots, [-little])) / (2 * little))
        wanted = np.concatenate(parts)
        most = 0.2 if batch.kind == "contact" else 0.02  # flows follow the state within a step
        assert got @ wanted / (wanted @ wanted) == pytest.approx(1.0, abs=most)
        assert np.linalg.norm(got - wanted) < most * np.linalg.norm(wanted)
