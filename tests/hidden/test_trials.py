"""The table of trials: complete, in step with its files, and its logs damaged where they say and nowhere else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.hidden.trials import EXPERIMENT, MODEL, SIMULATED, TRIALS, TRUTH, expected, stored, trial
from twin.diagnose.result.diagnosis import VERDICTS
from twin.inject.damage.kinds import DAMAGES
from twin.inject.experiment import HOUR, RUNS
from twin.inject.stored.files import Truth, measured
from twin.inject.stored.files import read as read_file
from twin.inject.stored.recipe import about, hidden_text
from twin.inject.stored.table import BROKEN, DOOR, SEALED, SUN
from twin.logs.check import check_run
from twin.logs.refuse import refusals
from twin.logs.run import Run
from twin.machine.effects.edits import EDITS
from twin.machine.load import load_machine

# Two sensors of which one shows the effect more than the other, and by how much at least [K]
MARKS = {
    "heat_source": ("bed_x_left", "bed_x_middle", 0.3),
    "coolant": ("table", "swivel", 2.0),
    "zone": ("carriage", "bed_stem_left", 0.4),
    "forced_convection": ("column_front_middle", "column_right", 0.35),
    "sun": ("column_left", "column_right", 0.8),
    "film_gain": ("quill_right", "x_nut", 1.2),
    "loss_law": ("x_motor", "bed_x_right", 1.0),
    "misplaced_source": ("z_motor", "bed_stem_left", 1.8),
    "joint": ("spindle", "quill_top", 0.5),
    "two": ("column_back", "x_nut", 0.5),
}
LARGEST = 1_600_000  # bytes of all files


@pytest.fixture(scope="module")
def described() -> str:
    return (MODEL / "machine.toml").read_text(encoding="utf-8")


def read(name: str) -> tuple[Truth, ...]:
    return read_file(EXPERIMENT, TRUTH / f"{name}.npz")[0]


def before(name: str) -> list[Run]:
    """The runs of a trial without what is done to its logs."""
    found = TRIALS[name]
    return [measured(EXPERIMENT, truth, found.noise) for truth in read_file(EXPERIMENT, TRUTH / found.file)[0]]


def contrast(name: str, a: str, b: str) -> float:
    """How far sensor a minus sensor b is from that of a machine without effect, K at most; means over half an hour."""
    found = []
    for truth, other in zip(read(name), read("null_0"), strict=True):
        i, j = truth.sensors.index(a), truth.sensors.index(b)
        apart = (truth.temperatures[:, i] - truth.temperatures[:, j]) - (
            other.temperatures[:, i] - other.temperatures[:, j]
        )
        found.append(np.abs(np.convolve(apart, np.full(30, 1.0 / 30.0), "valid")).max())
    return float(max(found))


def test_every_family_and_every_verdict_occur():
    families = {hidden.family for t in TRIALS.values() for hidden in t.hidden}
    assert families == {*EDITS, ""} - {"missing_joint"}  # no entry joins two of its parts that do not touch
    verdicts = {v for name in TRIALS for v in expected(name).verdicts}
    assert verdicts == {*VERDICTS} - {"too_poor"}  # the five-axis model is a good one


def test_every_trial_has_its_truth_and_every_truth_a_trial():
    assert stored() == tuple(TRIALS)
    assert {path.name for path in TRUTH.glob("*.npz")} == {t.file for t in TRIALS.values()}
    assert sum(path.stat().st_size for path in TRUTH.glob("*.npz")) < LARGEST


def test_names_seeds_and_noise_are_their_own():
    machines = [TRIALS[name].seed for name in SIMULATED if name not in ("expansion", "scale_expansion")]
    assert len(set(machines)) == len(machines)
    drawn = [(t.file, t.noise) for t in TRIALS.values()]
    assert len(set(drawn)) == len(drawn)  # no two trials share a log
    assert all(name == t.name for name, t in TRIALS.items())


@pytest.mark.parametrize("name", SIMULATED)
def test_a_file_is_of_the_table_as_it_is(name: str):
    assert read_file(EXPERIMENT, TRUTH / f"{name}.npz")[1] == about(TRIALS[name])


@pytest.mark.parametrize("name", SIMULATED)
def test_what_is_hidden_becomes_text_of_the_shipped_machine(name: str, described: str):
    found = TRIALS[name]
    text, felt = hidden_text(EXPERIMENT, described, found)
    assert (text != described) == bool(found.effects)
    shipped, machine = load_machine(MODEL / "machine.toml", described), load_machine(MODEL / "machine.toml", text)
    new = {s for s in machine.signals if s not in shipped.signals}
    for run in RUNS if new else ():
        assert set(felt[run]) == new
        for column in felt[run].values():
            assert 0.0 <= column.min() <= column.max() <= 1.0
    for signal in new:
        assert machine.signals[signal].default == 0.0  # a log without it is read
        assert max(np.ptp(felt[run][signal]) for run in RUNS) > 0.5
    if any(c.windows for c in found.effects):
        assert new


def test_windows_are_where_they_say(described: str):
    for name, windows in (("zone", DOOR), ("joint", BROKEN), ("sun", SUN)):
        _, felt = hidden_text(EXPERIMENT, described, TRIALS[name])
        for run in RUNS:
            ((_, column),) = felt[run].items()
            on = np.zeros(len(column), dtype=bool)
            for w in windows:
                if w.run == run:
                    on[math.ceil(w.start / 60.0) : math.ceil(w.end / 60.0)] = True
            np.testing.assert_array_equal(column > 0.0, on)


def test_the_heat_outside_the_catalogue_turns_its_sign_at_random(described: str):
    _, felt = hidden_text(EXPERIMENT, described, TRIALS["outside"])
    for run in RUNS:
        heating, cooling = felt[run].values()
        np.testing.assert_allclose(heating + cooling, 1.0)
        assert 4 < np.sum(np.diff((heating > 0.5).astype(int)) != 0) < 40


@pytest.mark.slow
@pytest.mark.parametrize("name", stored())
def test_runs_can_be_read(name: str):
    runs, wanted = trial(name).runs, expected(name)
    machine = load_machine(MODEL / "machine.toml")
    assert [run.folder.name for run in runs] == list(RUNS)
    for run in runs:
        assert not refusals(run)
        assert not [p for p in check_run(run, sensors=tuple(machine.sensors)) if not p.warning]
        assert run.tcp is not None
        assert np.isfinite(run.tcp.displacement).all()
    assert set(wanted.verdicts) <= set(VERDICTS)
    for hidden in wanted.causes:
        assert hidden.family in (*EDITS, "")
        if TRIALS[name].damages and hidden.family in DAMAGES and hidden.family != "slip":
            assert hidden.history in DAMAGES[hidden.family]
        if hidden.place and not hidden.place.startswith(("tcp.", "runs.")) and hidden.place != "artefact":
            section, _, entry = hidden.place.partition(".")
            assert section in machine.parts or entry in getattr(machine, section)


@pytest.mark.parametrize("name", [n for n, t in TRIALS.items() if t.truth or t.damages])
def test_a_log_is_damaged_where_it_says_and_nowhere_else(name: str):
    found = TRIALS[name]
    changed = set()
    for was, after in zip(before(name), trial(name).runs, strict=True):
        for section, a, b in (
            ("signals", was.loads, after.loads),
            ("sensors", was.temperatures, after.temperatures),
        ):
            assert a is not None
            assert b is not None
            changed |= {f"{section}.{c}" for c in a.columns if not np.array_equal(a.columns[c], b.columns[c])}
        assert was.tcp is not None
        assert after.tcp is not None
        moved = (was.tcp.displacement != after.tcp.displacement).any(axis=0)
        changed |= {f"tcp.d{'xyz'[k]}" for k in np.flatnonzero(moved)}
    places = {d.place for _, d in found.damages} | {d.other for _, d in found.damages if d.other}
    constant = {"signals.b_position", "signals.c_position"}  # zero at any time
    assert changed == places - constant
    if found.damages and not found.hidden[0].place.startswith(("runs.", "bed.")):
        assert found.hidden[0].place in places


def test_clocks_are_late_in_one_run():
    for was, after in zip(before("clock"), trial("clock").runs, strict=True):
        late = 6 if after.folder.name == "diagnosis_2" else 0
        speed = was.loads.columns["x_speed"]
        np.testing.assert_array_equal(after.loads.columns["x_speed"][late:], speed[: len(speed) - late])


def test_a_step_stays(described: str):
    for was, after in zip(before("not_thermal"), trial("not_thermal").runs, strict=True):
        assert was.tcp is not None
        assert after.tcp is not None
        moved = after.tcp.displacement[:, 0] - was.tcp.displacement[:, 0]
        start = {"diagnosis_1": math.inf, "diagnosis_2": 5.2 * HOUR, SEALED: 0.0}[after.folder.name]
        np.testing.assert_allclose(moved, np.where(after.tcp.time >= start, 10e-6, 0.0), atol=1e-12)


@pytest.mark.parametrize("name", MARKS)
def test_what_is_hidden_shows(name: str):
    a, b, least = MARKS[name]
    assert contrast(name, a, b) > least
    assert contrast("null_law", a, b) < least / 1.5  # what another machine differs by anyhow


def test_expansions_move_the_tcp_and_heat_nothing():
    null = read("null_law")
    for name in ("expansion", "scale_expansion"):
        for truth, other in zip(read(name), null, strict=True):
            np.testing.assert_array_equal(truth.temperatures, other.temperatures)
            assert np.abs(truth.tcp - other.tcp).max() > 4e-6
    for truth, other in zip(read("scale_expansion"), null, strict=True):
        moved = truth.tcp - other.tcp
        np.testing.assert_allclose(moved[:, [0, 2]], 0.0, atol=1e-9)
        # a scale that has grown reads too little on either side of where it is fixed
        late = truth.tcp_time > 4.0 * HOUR
        assert np.corrcoef(moved[late, 1], truth.positions[late, 1])[0, 1] < -0.9


def test_the_machine_is_warm_where_it_has_worked_before():
    for truth, cold in zip(read("initial_state"), read("null_law"), strict=True):
        assert np.ptp(cold.temperatures[0]) < 0.1
        assert np.ptp(truth.temperatures[0]) > 2.0
