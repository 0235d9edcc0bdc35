"""`twin update` on the small machine: truth is the full model of a disturbed description, not the model under test."""

import dataclasses
from functools import cache
from pathlib import Path

import jax
import numpy as np
import pytest

from models.scripts import load_script
from twin.build.simulate import Noise, simulate_run
from twin.calibrate.score.compare import simulated_tcp
from twin.calibrate.update.live import read_gains, read_state, write_live
from twin.calibrate.update.methods import Options, learnt, update_run
from twin.calibrate.update.plan import Plan
from twin.calibrate.update.program import Measurement
from twin.calibrate.update.schedule import Schedule
from twin.calibrate.update.state_filter import machine_of
from twin.calibrate.update.state_learn import sensors_at
from twin.calibrate.update.state_tangent import KINDS, acts_of, cold, separate_loads, tangent_step
from twin.errors import LogError, ModelError, TwinError
from twin.logs.run import Run, Table
from twin.logs.signals import signal_values
from twin.logs.write import write_run
from twin.rom.apply import with_values
from twin.rom.artefact import read_artefact
from twin.rom.drive import evaluate
from twin.run.replay import replay
from twin.run.system import prepare

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
SLIDE = ROOT / "tests" / "machines" / "slide"
NOISE = Noise(0.05, 0.3e-6, 1)
OPTIONS = Options(sensor_noise=0.05, tcp_noise=0.3e-6)
HOURS = 3.0


def loads() -> Table:
    """Two hours of strokes with a draughty middle, then rest."""
    time = np.arange(0.0, HOURS * 3600.0 + 1.0, 30.0)
    working = time < 2 * 3600.0
    speed = np.where(working, 0.2, 0.0)
    columns = {
        "x_position": 0.15 * np.sin(time / 47.0) * working,
        "x_speed": speed,
        "x_motor_current": np.where(working, 8.0, 0.0),
        "shop_air": 20.0 + np.sin(time / 4000.0),
    }
    return Table(time, columns, {"x_position": "m", "x_speed": "m/s", "x_motor_current": "A", "shop_air": "degC"})


@pytest.fixture(scope="session")
def truth(tmp_path_factory) -> Run:
    """What the disturbed full model measures: sensors every minute, the TCP every 5 min at the middle."""
    folder = tmp_path_factory.mktemp("disturbed")
    script = load_script(ROOT / "models" / "five_axis", "runs/make_truth.py")
    text, factors = script.disturbed((SLIDE / "machine.toml").read_text(encoding="utf-8"), 0.3, 3)
    assert {round(f, 6) for f in factors.values()} == {0.7, 1.3}
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    plain = Run(loads(), initial_temperature=20.0, provenance="test", synthetic=("loads",))
    write_run(folder / "run", plain)
    run, balance = simulate_run(folder, folder / "run", substeps=2, tcp_every=300.0, noise=NOISE)
    assert balance < 1e-8
    return run


@pytest.fixture(scope="session")
def artefact(slide_artefact):
    return read_artefact(slide_artefact)


@pytest.fixture(scope="session")
def base(artefact, truth):
    return replay(artefact, truth)


@pytest.fixture(scope="session")
def lived(artefact, truth, base):
    """Every method over the run, with an R-test every half hour."""

    @cache
    def of(method):
        return update_run(artefact, truth, dataclasses.replace(OPTIONS, method=method), Plan(1800.0), base=base)

    return of


def share(measured, predicted):
    return 1.0 - np.linalg.norm(measured - predicted) / np.linalg.norm(measured)


def test_tangent_is_the_derivative_of_the_runtime(artefact):
    """Against central differences of whole runs with other parameter values."""
    model, run = artefact.model, Run(loads(), initial_temperature=20.0)
    chosen = tuple(p for p in artefact.parameters if p.kind in KINDS)
    assert {p.kind for p in chosen} == set(KINDS)
    n = 30
    short = dataclasses.replace(run, loads=Table(run.loads.time[: 2 * n + 1],
        {k: v[: 2 * n + 1] for k, v in run.loads.columns.items()}, run.loads.units))  # fmt: skip
    drive = evaluate(model.load_model, short.loads.time, signal_values(short, model.load_model.signals), 60.0)
    prepared, stacked = prepare(model), separate_loads(model.load_model, drive, 4)
    z0 = jax.numpy.asarray(prepared.uniform(20.0))
    at = [jax.tree.map(lambda a, k=k: a[k], stacked) for k in range(n)]
    state = cold(prepared.layout, prepared.system, z0, at[0])
    count = len(chosen)
    dz, du, u = jax.numpy.zeros((model.n, count)), jax.numpy.eye(count), jax.numpy.zeros(count)
    acts = acts_of(model.load_model, chosen)
    for step in at:
        state, dz = tangent_step(prepared.layout, prepared.system, acts, state, u, dz, du, step)
    C = np.asarray(prepared.system.C)
    nominal = replay(artefact, short, substeps=4).temperature[-1, : len(C)]
    np.testing.assert_allclose(20.0 + C @ np.asarray(state.z), nominal, atol=1e-9)
    for kind in KINDS:
        k = [p.kind for p in chosen].index(kind)
        p, e = chosen[k], 1e-3
        ends = []
        for sign in (1.0, -1.0):
            value = p.nominal * np.exp(sign * e) if p.scale == "log" else p.nominal + sign * e
            other = dataclasses.replace(artefact, model=with_values(model, chosen, {p.path: value}))
            ends.append(replay(other, short, substeps=4).temperature[-1, : len(C)])
        central = (ends[0] - ends[1]) / (2.0 * e)
        assert np.abs(central).max() > 0.0
        np.testing.assert_allclose(C @ np.asarray(dz)[:, k], central, atol=2e-4 * np.abs(central).max() + 1e-9)


def test_state_filter_makes_up_for_parameters_off_by_30_percent(lived, truth):
    """Scored before assimilating, on all rows, used or not; noise included."""
    updated, live, program = lived("state")
    assert int(updated.used.sum()) == 6
    measured = updated.measured
    assert share(measured, updated.predicted_base) < 0.85
    assert share(measured, updated.predicted) > 0.93
    assert 1.0 - share(measured, updated.predicted) < 0.5 * (1.0 - share(measured, updated.predicted_base))
    known = sensors_at(program.updater.machine, live.state)
    final = [truth.temperatures.columns[s][-1] for s in program.model.sensors]
    np.testing.assert_allclose(known, final, atol=0.25)


def test_it_learns_what_it_was_told_about(lived, artefact):
    """The motor is the largest source and has a sensor beside it: planted times 0.7 or 1.3, found within 10 %."""
    _, live, _ = lived("state")
    script = load_script(ROOT / "models" / "five_axis", "runs/make_truth.py")
    _, factors = script.disturbed((SLIDE / "machine.toml").read_text(encoding="utf-8"), 0.3, 3)
    values = learnt(artefact, live)
    value, sigma = values["sources.x_motor.gain"]
    assert value == pytest.approx(factors["sources.x_motor.gain"], rel=0.1)
    assert sigma < 0.1


@pytest.mark.slow
def test_uncertainty_covers_what_was_held_out(lived):
    updated, _, _ = lived("state")
    out = ~updated.used
    sigma = np.hypot(updated.predicted_sigma[out], NOISE.displacement)
    inside = np.abs(updated.measured[out] - updated.predicted[out]) <= 1.96 * sigma
    assert inside.mean() >= 0.90
    rms = np.sqrt(np.mean((updated.measured[out] - updated.predicted[out]) ** 2))
    assert np.sqrt(np.mean(sigma**2)) < 3.0 * rms  # nor is it idle talk


@pytest.mark.parametrize("method", ["gain", "state"])
def test_nothing_is_known_before_it_is_measured(artefact, truth, base, lived, method):
    """Rows and temperatures of the second half are changed: predictions of the first half are the same, bit by bit."""
    half = HOURS * 1800.0
    tcp, sensors = truth.tcp, truth.temperatures
    later = tcp.time > half
    columns = {k: np.where(sensors.time > half, v + 1.0, v) for k, v in sensors.columns.items()}
    changed = dataclasses.replace(
        truth,
        tcp=dataclasses.replace(tcp, displacement=tcp.displacement + 2e-6 * later[:, None]),
        temperatures=dataclasses.replace(sensors, columns=columns),
    )
    updated, _, _ = update_run(artefact, changed, dataclasses.replace(OPTIONS, method=method), Plan(1800.0), base=base)
    before = lived(method)[0]
    np.testing.assert_array_equal(updated.predicted[~later], before.predicted[~later])
    assert np.abs(updated.predicted - before.predicted)[later].max() > 1e-7


@pytest.mark.parametrize("method", ["gain", "state"])
def test_correction_never_jumps(artefact, truth, base, method):
    """A measurement changes at once what is known, not at all what the control is told; that follows at the slew."""
    slew = 0.5e-6 / 60.0
    options = dataclasses.replace(OPTIONS, method=method, slew=slew)
    _, _, program = update_run(artefact, truth, options, Plan(1800.0), base=base)
    live, tcp = program.begin(), truth.tcp
    for step in range(60):
        live = program.advance(live, step)
    place = np.zeros(1)
    told_before, known_before = program.at_poses(live), program.updater.at_poses(live.state)
    live, told = program.assimilate(live, Measurement(3600.0, place, tcp.displacement[11] + 5e-6))
    assert any(t.accepted for t in told)
    assert np.abs(program.updater.at_poses(live.state) - known_before).max() > 1e-6
    np.testing.assert_allclose(program.at_poses(live), told_before, atol=1e-15)
    held = live.held
    for step in range(60, 64):
        live = program.advance(live, step)
        assert np.abs(live.held - held).max() <= slew * 60.0 * (1.0 + 1e-9)
        assert np.all(np.abs(live.held) <= np.abs(held))
        held = live.held


@pytest.mark.parametrize("method", ["gain", "state"])
def test_a_slipped_probe_is_reported_and_does_no_harm(artefact, truth, base, lived, method):
    slipped = truth.tcp.displacement.copy()
    row = int(np.flatnonzero(lived(method)[0].used)[3])
    slipped[row, 2] += 60e-6
    run = dataclasses.replace(truth, tcp=dataclasses.replace(truth.tcp, displacement=slipped))
    updated, _, _ = update_run(artefact, run, dataclasses.replace(OPTIONS, method=method), Plan(1800.0), base=base)
    rejected = [t for t in updated.told if not t.accepted]
    assert [(t.name, round(1e6 * t.innovation, -1)) for t in rejected] == [("dz", 60.0)]
    keep = np.arange(len(slipped)) != row
    error = np.abs(updated.predicted - truth.tcp.displacement)[keep].max()
    assert error < np.abs(lived(method)[0].predicted - truth.tcp.displacement)[keep].max() + 2e-6


def test_a_broken_sensor_is_left_out(artefact, truth, base, lived):
    columns = dict(truth.temperatures.columns)
    columns["block"] = np.where(truth.temperatures.time > 3600.0, 85.0, columns["block"])  # a loose wire
    run = dataclasses.replace(truth, temperatures=dataclasses.replace(truth.temperatures, columns=columns))
    updated, _, _ = update_run(artefact, run, OPTIONS, Plan(1800.0), base=base)
    rejected = [t.name for t in updated.told if not t.accepted]
    assert set(rejected) == {"block"}
    assert len(rejected) == HOURS * 60 - 60
    assert share(updated.measured, updated.predicted) > share(updated.measured, updated.predicted_base)


def test_scheduler_asks_less_where_more_is_tolerated(artefact, truth, base):
    used = {}
    for tolerance in (2e-6, 8e-6, 40e-6):
        plan = Plan(None, Schedule(tolerance))
        updated, _, _ = update_run(artefact, truth, dataclasses.replace(OPTIONS, method="gain"), plan, base=base)
        used[tolerance] = int(updated.used.sum())
        assert len(updated.asked) - used[tolerance] in (0, 1)  # the last request may find no row
        first = [updated.row_time[updated.row_time > t].min() for t in updated.asked[: used[tolerance]]]
        np.testing.assert_array_equal(updated.row_time[updated.used], first)
    assert used[2e-6] > used[8e-6] > used[40e-6]


@pytest.mark.parametrize("method", ["state", "gain", "paper"])
def test_a_program_started_again_goes_on_with_the_very_same_numbers(artefact, lived, tmp_path, method):
    _, _, program = lived(method)
    values = np.full(len(program.model.sensors), 20.5)

    def through(live, steps):
        for step in steps:
            live = program.advance(live, step)
            live, _ = program.temperatures(live, values, np.ones(len(values)))
        return live

    half = through(program.begin(), range(40))
    write_live(tmp_path, program, half)
    if method == "state":
        first = jax.tree.map(lambda a: a[0], program.updater.loads)
        back = read_state(tmp_path / "state.h5", program.updater.machine, first)
    else:
        back = read_gains(tmp_path / "state.json")
    a, b = through(half, range(40, 60)), through(back, range(40, 60))
    np.testing.assert_array_equal(program.at_poses(a), program.at_poses(b))
    for place in ([-0.1], [0.17]):
        for x, y in zip(program.predict(a, np.array(place)), program.predict(b, np.array(place)), strict=True):
            np.testing.assert_array_equal(x, y)


def test_states_of_other_machines_are_refused(artefact, lived, tmp_path):
    _, live, program = lived("state")
    write_live(tmp_path, program, live)
    fewer = machine_of(artefact, parameters=program.updater.machine.parameters[1:])
    first = jax.tree.map(lambda a: a[0], program.updater.loads)
    with pytest.raises(TwinError, match="other parameters"):
        read_state(tmp_path / "state.h5", fewer, first)
    (tmp_path / "broken.h5").write_bytes(b"nothing")
    with pytest.raises(TwinError, match="not a state"):
        read_state(tmp_path / "broken.h5", fewer, first)
    for text in ("{}", "[1]", "nonsense"):
        (tmp_path / "state.json").write_text(text, encoding="utf-8")
        with pytest.raises(TwinError, match="not a state"):
            read_gains(tmp_path / "state.json")


@pytest.mark.parametrize("method", ["gain", pytest.param("state", marks=pytest.mark.long)])
@pytest.mark.parametrize("first", [0, 5])
def test_deviations_that_count_from_the_first_row(artefact, truth, base, method, first):
    """They stand on what is predicted when that row comes: an unknown zero of the probe is none of the machine's."""
    whole = truth.tcp
    counted = dataclasses.replace(
        whole,
        time=whole.time[first:],
        position=whole.position[first:],
        displacement=whole.displacement[first:] - whole.displacement[first],
        sigma=None,
    )
    run = dataclasses.replace(truth, tcp=counted, tcp_reference="first")
    updated, *_ = update_run(artefact, run, dataclasses.replace(OPTIONS, method=method), Plan(1800.0), base=base)
    assert updated.reference == whole.time[first]
    assert not np.isin(updated.reference, updated.row_time)
    assert len(updated.row_time) == len(whole.time) - first - 1
    zero = updated.measured - counted.displacement[1:]
    np.testing.assert_allclose(zero, np.broadcast_to(zero[0], zero.shape), atol=1e-15)
    if method == "gain":  # nothing is learnt before: what the base model computes there
        computed = simulated_tcp(artefact, base, whole.time[first : first + 1], whole.position[first : first + 1])
        np.testing.assert_allclose(zero[0], computed[0], atol=0.1e-6)  # an update interpolates between the poses
        np.testing.assert_allclose(updated.predicted[0], updated.predicted_base[0], atol=1e-12)
    rest = np.linalg.norm(updated.measured - updated.predicted)
    assert rest < (0.75 if method == "gain" else 0.5) * np.linalg.norm(updated.measured - updated.predicted_base)


def test_what_cannot_be_updated_is_refused(artefact, truth):
    with pytest.raises(LogError, match=r"no tcp\.csv"):
        update_run(artefact, dataclasses.replace(truth, tcp=None), OPTIONS)
    early = dataclasses.replace(truth.tcp, time=truth.tcp.time - 1e5)
    with pytest.raises(LogError, match="count from the first row, which is outside the loads"):
        update_run(artefact, dataclasses.replace(truth, tcp=early, tcp_reference="first"), OPTIONS)
    with pytest.raises(ModelError, match="as parameters"):
        update_run(dataclasses.replace(artefact, parameters=()), truth, OPTIONS)
