"""Contacts whose conductance a signal switches: in the drive, the full model, the runtime and the window model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.descriptions import edited
from twin.build.full_model import assemble
from twin.build.pipeline import rich_model
from twin.build.rich_basis import RichOptions
from twin.build.scenario import theta_bounds
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.calibrate.fit.effects import effects_of
from twin.calibrate.fit.integration import loads_for, trajectory
from twin.calibrate.fit.window import merged
from twin.errors import DescriptionError, LogError
from twin.machine.check import check_machine
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.rom.apply import with_values
from twin.rom.contact_matrix import ContactPlaces
from twin.rom.drive import Drive, evaluate
from twin.rom.load_model import LoadModel
from twin.rom.model import MachineModel
from twin.run.replay import integrate
from twin.run.stepping import inputs_of
from twin.run.system import prepare

pytestmark = pytest.mark.long

FACTOR = {"plate": 0.02, "x_guide": 4.0, "x_screw": 0.1}
CLAMP = '[signals.clamp]\nunit = "1"\nrange = [0, 1]\n\n'
EDITS = (
    ("[signals.x_position]", f"{CLAMP}[signals.x_position]"),
    *((f"[contacts.{name}]", f'[contacts.{name}]\nswitch = "clamp"\nswitched = {f}') for name, f in FACTOR.items()),
)
STEPS = 24


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    return load_machine(edited(tmp_path_factory.mktemp("switched"), *EDITS))


@pytest.fixture(scope="module")
def models(machine) -> dict[str, MachineModel]:
    full = assemble(machine)
    return {"full": full.thermal, "reduced": rich_model(machine, full, RichOptions(samples=6))}


def drive_of(load: LoadModel, clamp: np.ndarray, sweep: float = 0.15) -> Drive:
    """A warm-up with a sweeping axis; clamp (STEPS,), one value per step of 60 s; sweep [m]."""
    time = np.arange(0.0, 60.0 * STEPS, 10.0)
    signals = {
        "x_position": sweep * np.sin(time / 300.0), "x_speed": np.full(len(time), 0.3),
        "x_current": np.full(len(time), 9.0), "shop_air": np.full(len(time), 24.0), "clamp": np.repeat(clamp, 6),
    }  # fmt: skip
    return evaluate(load, time, signals, 60.0, STEPS)


def always(model: MachineModel) -> MachineModel:
    """The machine whose contacts are switched for good."""
    load = model.load_model

    def shut(contact):
        return replace(contact, conductance=contact.conductance * contact.switched, switch="", switched=1.0)

    return replace(
        model, load_model=replace(load, joints=tuple(map(shut, load.joints)), pairs=tuple(map(shut, load.pairs)))
    )


def test_conductances_follow_the_signal(models):
    load = models["full"].load_model
    clamp = np.linspace(0.0, 1.0, STEPS)
    drive, off = drive_of(load, clamp), drive_of(load, np.zeros(STEPS))
    at = load.theta_names.index("contacts.plate.conductance")
    np.testing.assert_allclose(drive.theta[:, at], 5000.0 * (1.0 + (0.02 - 1.0) * clamp), rtol=1e-13)
    rest = [k for k in range(len(load.theta_names)) if k != at]
    np.testing.assert_array_equal(drive.theta[:, rest], off.theta[:, rest])
    for k, pair in enumerate(load.pairs):
        wanted = pair.conductance * pair.area * (1.0 + (FACTOR[pair.contact] - 1.0) * clamp)
        np.testing.assert_allclose(drive.conductance[:, k], wanted, rtol=1e-13)
    low, high = theta_bounds(load)
    assert (low[at], high[at]) == pytest.approx((5000.0 * 0.02 / 3, 15000.0), rel=1e-12)


def test_a_step_takes_the_mean_and_a_wild_signal_is_clipped_and_flagged(models):
    load = models["full"].load_model
    at = load.theta_names.index("contacts.plate.conductance")
    time = np.arange(0.0, 120.0, 10.0)
    signals = {s.name: np.zeros(len(time)) for s in load.signals} | {"shop_air": np.full(len(time), 20.0)}
    half = evaluate(load, time, signals | {"clamp": (time < 30.0).astype(float)}, 60.0)
    np.testing.assert_allclose(half.theta[:, at], [5000.0 * (1.0 - 0.98 / 2), 5000.0], rtol=1e-13)
    wild = evaluate(load, time, signals | {"clamp": np.full(len(time), 7.0)}, 60.0)
    np.testing.assert_allclose(wild.theta[:, at], 100.0, rtol=1e-12)
    assert wild.flags[:, wild.flag_names.index("signals.clamp above 1 1")].all()
    with pytest.raises(LogError, match="clamp"):
        evaluate(load, time, {k: v for k, v in signals.items() if k != "clamp"}, 60.0)


@pytest.mark.parametrize("kind", ["full", "reduced"])
def test_switching_halfway_is_two_runs_stitched(models, kind):
    """The stepper with exact factors, and its heat balance with them and with those it keeps."""
    model = models[kind]
    half = STEPS // 2
    drive = drive_of(model.load_model, (np.arange(STEPS) >= half).astype(float))
    x = CoupledStepper(model).uniform(20.0)
    got = [state for _, state, _ in CoupledStepper(model, follow=0.0).run(drive, x)]
    open_, shut = (drive_of(m.load_model, np.zeros(STEPS)) for m in (model, always(model)))
    first = [s for _, s, _ in CoupledStepper(model, follow=0.0).run(open_, x)][:half]
    second = [s for _, s, _ in CoupledStepper(always(model), follow=0.0).run(shut, first[-1], first=half)]
    unswitched = [s for _, s, _ in CoupledStepper(model, follow=0.0).run(open_, x)][-1]
    for ours, theirs in zip(got, [*first, *second], strict=True):
        np.testing.assert_allclose(np.concatenate(ours), np.concatenate(theirs), rtol=1e-9, atol=1e-9)
    apart = sensor_temperatures(model, got[-1]) - sensor_temperatures(model, unswitched)
    assert np.abs(apart).max() > 0.1
    creeping = drive_of(model.load_model, np.linspace(0.0, 1.0, STEPS))
    for _, _, heat in CoupledStepper(model).run(creeping, x):
        assert heat.balance_error < 1e-10


def test_the_runtime_is_the_stepper_and_close_to_the_full_model(models):
    model, full = models["reduced"], models["full"]
    drive = drive_of(model.load_model, np.concatenate([np.zeros(STEPS // 2), np.linspace(1.0, 0.3, STEPS // 2)]))
    prepared = prepare(model)
    steps = integrate(prepared, inputs_of(model.load_model, drive, 1, follow=0.0), prepared.uniform(20.0))
    states = prepared.to_artefact(steps.z)
    stepper = CoupledStepper(model, follow=0.0)
    expected = np.array([np.concatenate(x) for _, x, _ in stepper.run(drive, stepper.uniform(20.0))])
    assert np.abs(states - expected).max() < 1e-9 * np.abs(expected).max()
    T = steps.z @ np.asarray(prepared.system.C).T
    truth = CoupledStepper(full)
    last = [x for _, x, _ in truth.run(drive, truth.uniform(20.0))][-1]
    np.testing.assert_allclose(T[-1] + 20.0, sensor_temperatures(full, last), atol=0.02)


def test_a_factor_kept_while_a_joint_creeps_changes_little(models):
    """The axis at rest and moving contacts as they are: only the joint makes the runtime factorise."""
    model = models["reduced"]
    load = replace(model.load_model, pairs=tuple(replace(p, switch="") for p in model.load_model.pairs))
    drive = drive_of(load, np.linspace(0.0, 1.0, STEPS), sweep=0.0)
    prepared = prepare(model)
    inputs = (inputs_of(load, drive, 1, follow=0.0), inputs_of(load, drive, 1))
    exact, kept = (integrate(prepared, given, prepared.uniform(20.0)) for given in inputs)
    apart = np.abs((kept.z - exact.z) @ np.asarray(prepared.system.C).T).max()
    assert 0.0 < apart < 2e-3
    heat = np.diff(drive.time) * (kept.power.sum(axis=1) + kept.film.sum(axis=1))
    np.testing.assert_allclose(kept.stored, heat, atol=1e-10 * np.abs(heat).max())


@pytest.mark.parametrize("value", [1.0, 1.7])
def test_the_window_model_takes_switched_contacts(machine, models, value):
    """Its step against the runtime's, at the described conductances and at others."""
    model = models["reduced"]
    chosen = [p for p in parameters(machine) if p.kind in ("joint", "contact")]
    clamp = (np.arange(STEPS) >= STEPS // 2).astype(float)
    n = model.n
    small = merged(model, np.eye(n))  # E = 1 already
    prepared, drive = prepare(small), drive_of(model.load_model, clamp)
    effects = effects_of(small, chosen, [])
    start = 4.0 * small.bodies[0].one
    states = trajectory(
        prepared.layout, ContactPlaces.of(small.load_model), False, prepared.system, effects,
        loads_for(small, drive, 2), prepared.from_artefact(start), np.full(len(chosen), np.log(value)),
    )  # fmt: skip
    there = with_values(model, chosen, {p.path: value * p.nominal for p in chosen})
    ready = prepare(there)
    inputs = inputs_of(there.load_model, drive_of(there.load_model, clamp), 2, follow=0.0)
    wanted = ready.to_artefact(integrate(ready, inputs, ready.from_artefact(start)).z)
    got = prepared.to_artefact(np.asarray(states)[1:])
    assert np.abs(got - wanted).max() < 1e-8 * np.abs(wanted).max()


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("switched = 0.02", "", "belong together"),
        ('switch = "clamp"\nswitched = 0.02', "switched = 0.02", "belong together"),
        ("switched = 0.02", "switched = 0", "greater than 0"),
        ('switch = "clamp"\nswitched = 0.02', 'switch = "clump"\nswitched = 0.02', "did you mean 'clamp'"),
        ('switch = "clamp"\nswitched = 0.02', 'switch = "x_current"\nswitched = 0.02', "expected a unit of 1"),
        ("range = [0, 1]", "range = [0, 2]", "outside 0 .. 1"),
    ],
)
def test_what_is_refused(tmp_path, old, new, what):
    text = edited(tmp_path, *EDITS).read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(DescriptionError, match=what):
        load_machine(tmp_path, text.replace(old, new))


def test_a_switch_is_a_use_of_its_signal(machine):
    assert not any("clamp" in p.where for p in check_machine(machine))
    plain = load_machine(Path(__file__).parents[1] / "machines" / "slide")
    unwired = machine.model_copy(update={"contacts": plain.contacts})
    assert any("clamp" in p.where for p in check_machine(unwired))


def test_artefacts_from_before_there_were_switches_are_read(models):
    load = always(models["full"]).load_model
    old = load.to_json()
    for entry in (*old["joints"], *old["pairs"]):
        del entry["switch"], entry["switched"]
    assert LoadModel.from_json(old) == load
    switched = models["full"].load_model
    assert LoadModel.from_json(switched.to_json()) == switched
