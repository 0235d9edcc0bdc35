"""The time integration of a diagnosis: the numbers of a calibration where nothing is hidden, and exact derivatives."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.calibrate import lumped_case
from tests.diagnose import small_case
from twin.calibrate.fit import integration as plain
from twin.calibrate.fit.measured import measured
from twin.diagnose.faults.acted import slots_with
from twin.diagnose.faults.elements import elements_of
from twin.diagnose.faults.fault import Unit
from twin.diagnose.faults.table import OF_KIND
from twin.diagnose.model import integration
from twin.diagnose.model.bank import nominal_run
from twin.diagnose.model.integration import stands_still, states_of
from twin.diagnose.model.probed_loads import loads_for
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.slots import first_slots, no_slots
from twin.diagnose.model.study import Study, make_study
from twin.machine.load import load_machine
from twin.machine.parameters import parameters

KINDS = [("heat", "housing"), ("film", "bed"), ("capacity", "slide"), ("contact", "x_screw")]


def units(kinds, study):
    """Amplitudes that act in the middle of every run."""
    gates = []
    for planned in study.runs:
        gate = np.zeros(planned.run.drive.n_steps)
        gate[60:-30] = 1.0
        gates.append(gate)
    return [Unit(OF_KIND[kind], place, -1, tuple(gates)) for kind, place in kinds]


@pytest.mark.long
@pytest.mark.parametrize("spread", [0.0, 0.6])
def test_without_slots_it_is_the_integration_of_a_calibration(spread):
    """Steps of a minute, one matrix each, beside implicit Euler of a second and a half, at any parameters."""
    study = small_case.study()
    probed, model = study.probed, study.probed.base
    planned = study.runs[0]
    x = spread * np.random.default_rng(1).standard_normal(len(probed.parameters))
    v = np.concatenate([x * study.scale, np.zeros(2)])
    empty = no_slots(planned.run.drive.n_steps, 2, model.n, model)
    own = loads_for(model, planned.run.drive)
    got = states_of(probed.layout, probed.contacts, False, stands_still(probed.layout, own, empty), probed.ports_first,
                    study.effects, own, empty, planned.z0, v)  # fmt: skip
    loads = plain.loads_for(model, planned.run.drive, 40)
    wanted = plain.trajectory(
        probed.layout, probed.contacts, False, probed.system, study.effects, loads, planned.z0, x * study.scale
    )
    assert np.ptp(wanted) > 1.0
    got, wanted = (np.asarray(s) @ np.asarray(probed.system.C).T for s in (got, wanted))
    error = got - wanted  # the largest where a load switches a node of less than a minute
    assert np.abs(error).max() < 0.02 * np.abs(wanted).max()
    assert np.sqrt(np.mean(error**2)) < 2e-3 * np.abs(wanted).max()


def test_coarse_steps_stay_near_fine_ones():
    """Five minutes share a matrix with the means of films and contacts. The nut strokes over the screw meanwhile: what
    the screw shows of a single stroke is lost there."""
    study = small_case.study()
    probed, model, planned = study.probed, study.probed.base, study.runs[1]
    x = np.zeros(len(probed.parameters))
    fine = plain.trajectory(probed.layout, probed.contacts, False, probed.system, study.effects,
                            plain.loads_for(model, planned.run.drive, 40), planned.z0, x)  # fmt: skip
    coarse = study.states(1, x)
    assert coarse.shape == (planned.run.drive.n_steps + 1, model.n)
    C = np.asarray(probed.system.C)
    error = np.sqrt(np.mean(((coarse - np.asarray(fine)) @ C.T) ** 2, axis=0))
    size = np.abs(np.asarray(fine) @ C.T).max(axis=0)
    assert model.sensors == ("front", "housing", "screw_middle")
    assert (error > 0.0).all()
    assert (error[:2] < 0.01 * size[:2]).all()
    assert error[2] < 0.1 * size[2]


def test_joints_that_stand_still_need_no_term_in_every_step():
    study = small_case.study()
    probed, planned = study.probed, study.runs[0]
    loads, x = planned.run.loads, 0.3 * np.random.default_rng(4).standard_normal(len(probed.parameters))
    none = first_slots(study.slots(0), 0)
    assert stands_still(probed.layout, loads, none)
    switched = study.slots(0)
    switched.joint[60:, 0, 0] = 1.0
    assert not stands_still(probed.layout, loads, switched)
    still, moving = (
        states_of(probed.layout, probed.contacts, False, alike, probed.ports_first, study.effects, loads, none,
                  planned.z0, x * study.scale) for alike in (True, False)
    )  # fmt: skip
    assert np.ptp(still) > 1.0
    np.testing.assert_allclose(still, moving, rtol=1e-9, atol=1e-9)


@pytest.mark.long
def test_derivatives_made_in_blocks_of_steps_are_the_same(monkeypatch):
    """Beside so many slots the terms of a step are more than a processor keeps; 72 steps are four blocks and a half."""
    study = small_case.study()
    probed, planned = study.probed, study.runs[0]
    slots = first_slots(slots_with(study, small_case.elements(), units(KINDS, study), 0), 4)
    loads = jax.tree.map(lambda own: own[:72], planned.run.loads)
    u = 0.3 * np.random.default_rng(4).standard_normal(len(probed.parameters)) * study.scale

    def derivatives(slots, a):
        states = partial(integration.trajectory, probed.layout, probed.contacts, True, False, probed.ports_first,
                         study.effects, loads, slots, planned.z0)  # fmt: skip
        z, D = jax.jit(lambda v: (states(v), jax.jacfwd(states)(v)))(jnp.concatenate([u, a]))
        return z, D[..., : len(u) + 4]

    short, wide = {}, no_slots(72, 160, probed.base.n, probed.base)
    for f in fields(slots):
        own, among = getattr(slots, f.name), getattr(wide, f.name)
        per_step = len(own) > 72
        short[f.name] = own[:72] if per_step else own
        among[(slice(None), slice(4)) if per_step else slice(4)] = short[f.name]
    a, in_blocks, called = np.array([5.0, 2.0, 3000.0, 0.3]), integration._in_blocks, []

    def told(*given):
        called.append(given)
        return in_blocks(*given)

    monkeypatch.setattr(integration, "_in_blocks", told)
    z, D = derivatives(replace(slots, **short), a)
    assert not called
    by_blocks, D_by_blocks = derivatives(wide, np.pad(a, (0, 156)))
    assert called
    assert np.ptp(z) > 1.0
    np.testing.assert_allclose(by_blocks, z, rtol=1e-9, atol=1e-9)
    size = np.abs(D).max(axis=(0, 1))
    assert (size > 0.0).sum() >= 30
    assert (np.abs(D_by_blocks - D).max(axis=(0, 1)) <= 1e-8 * size).all()


@pytest.mark.long
def test_derivatives_by_parameters_and_amplitudes():
    study = small_case.study()
    x = 0.2 * np.random.default_rng(2).standard_normal(len(study.probed.parameters))
    slots = slots_with(study, small_case.elements(), units(KINDS, study), 0)
    a = [5.0, 2.0, 3000.0, 0.3]
    J = study.jacobian(0, x, slots, a)
    assert J.shape[0] == study.runs[0].size
    assert J.shape[1] >= len(x) + len(a)
    every = [(k, 1e-3) for k in range(0, len(x), 6)] + [(len(x) + k, 1e-3 * a[k]) for k in range(len(a))]
    for k, h in every:

        def moved(by, k=k):
            y, b = x.copy(), np.array(a)
            if k < len(x):
                y[k] += by
            else:
                b[k - len(x)] += by
            return study.outputs(0, y, slots, b)

        difference = (moved(h) - moved(-h)) / (2 * h)
        scale = np.abs(difference).max()
        if scale * h > 1e-11:  # parameters that nothing here depends on have no difference
            assert np.abs(J[:, k] - difference).max() < 3e-3 * scale, k


@pytest.mark.long
def test_derivatives_by_amplitudes_alone_are_the_same():
    study = small_case.study()
    x = np.zeros(len(study.probed.parameters))
    slots = slots_with(study, small_case.elements(), units(KINDS, study), 1)
    a = [5.0, 2.0, 3000.0, 0.3]
    y, D = study.by_amplitudes(1, x, slots, a)
    np.testing.assert_allclose(y, study.outputs(1, x, slots, a), rtol=1e-9)
    np.testing.assert_allclose(D, study.jacobian(1, x, slots, a)[:, len(x) :], rtol=1e-6, atol=1e-12)
    assert (np.abs(D).max(axis=0) > 0.0).all()
    few, first = study.by_amplitudes(1, x, slots, a[:2])  # slots behind the told ones do nothing
    np.testing.assert_allclose(few, study.outputs(1, x, slots, a[:2]), rtol=1e-9)
    assert first.shape == (len(y), 2)


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_a_misplaced_source_emits_what_it_emits_where_it_is(share):
    """At another gain than declared, and heating another node: as if the machine were built so."""
    study = small_case.study()
    probed, load = study.probed, study.probed.base.load_model
    j = next(i for i, source in enumerate(load.sources) if not source.contact)
    B = np.asarray(probed.system.B)
    there = probed.B[next(i for i, p in enumerate(probed.places) if not np.any(probed.B[i] * B[:, j]))] - B[:, j]
    slots = study.slots(0)
    slots.B[0][:, j] = there
    x = np.zeros(len(probed.parameters))
    x[[p.path for p in probed.parameters].index(f"sources.{load.sources[j].name}.gain")] = 0.5
    moved = B.copy()
    moved[:, j] += share * there
    other = replace(study, probed=replace(probed, system=replace(probed.system, B=moved)))
    np.testing.assert_allclose(study.outputs(0, x, slots, [share]), other.outputs(0, x), rtol=1e-9, atol=1e-12)
    assert np.abs(study.outputs(0, x) - other.outputs(0, x)).max() > 1.0


def of_warm_bearing(node: str) -> Study:
    """The study of a machine whose front bearing heats a node, by a law that follows how warm that is."""
    text = (lumped_case.FOLDER / "machine.toml").read_text("utf-8")
    front = next(section for section in text.split("\n\n") if section.startswith("[sources.front]"))
    oil = 'viscosity_40 = "22e-6 m^2/s", viscosity_100 = "5e-6 m^2/s"'
    warm = f"""[sources.front]
law = "bearing_friction_warm"
surface = "{node}"
parameters = {{ {oil}, f0 = 2.0, diameter = "90 mm", f1 = 0.0005, load = "800 N" }}
signals = {{ speed = "spindle_speed" }}"""
    machine = load_machine(lumped_case.FOLDER / "machine.toml", text.replace(front, warm))
    probed = make_probed_model(machine, parameters(machine), small_case.runs())
    plans = [measured(probed.base, run, b.drive, b.name) for run, b in zip(small_case.runs(), probed.runs, strict=True)]
    return make_study(probed, plans, range(2))


@pytest.mark.long
def test_a_misplaced_source_is_as_warm_as_where_it_is():
    """At another gain than declared: as if the machine were described so."""
    study, other = of_warm_bearing("bearing_front"), of_warm_bearing("housing")
    elements = elements_of(study, [nominal_run(study, k) for k in range(3)])
    x = np.zeros(len(study.probed.parameters))
    x[[p.path for p in study.probed.parameters].index("sources.front.gain")] = 0.5
    column = elements.index["moved", "front>housing", "always"]
    always = tuple(np.ones(planned.run.drive.n_steps) for planned in study.runs)
    slots = slots_with(study, elements, [Unit(OF_KIND["moved"], "front>housing", column, always)], 0)
    np.testing.assert_allclose(study.outputs(0, x, slots, [1.0]), other.outputs(0, x), rtol=1e-9, atol=1e-12)
    assert np.abs(study.outputs(0, x) - other.outputs(0, x)).max() > 1.0
    slots.reads[:] = 0.0  # nor is it as warm as where it was described
    assert np.abs(study.outputs(0, x, slots, [1.0]) - other.outputs(0, x)).max() > 0.1


def test_read_is_what_outputs_say():
    study = small_case.study()
    x = 0.3 * np.random.default_rng(3).standard_normal(len(study.probed.parameters))
    T, w = study.read(0, study.states(0, x), x)
    wanted_T, wanted_w = study.runs[0].split(study.outputs(0, x))
    np.testing.assert_allclose(T, wanted_T, rtol=1e-12)
    np.testing.assert_allclose(w, wanted_w, atol=1e-15)


def test_more_amplitudes_than_slots_are_refused():
    study = small_case.study()
    many = units([("heat", "housing")] * 20, study)
    with pytest.raises(ValueError, match="more amplitudes than slots"):
        slots_with(study, small_case.elements(), many, 0)


def test_a_plan_for_every_run():
    from twin.diagnose.model.study import make_study
    from twin.errors import TwinError

    study = small_case.study()
    with pytest.raises(TwinError, match="a plan per run"):
        make_study(study.probed, [study.runs[0].measured], [0])
    again = make_study(study.probed, [p.measured for p in study.runs], range(1))
    assert again.fitted == (0,)
    assert replace(again, fitted=(0, 1)).fitted == study.fitted
