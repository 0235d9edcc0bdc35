"""Other values of parameters: the same model as a description with these values gives."""

import numpy as np
import pytest

from tests.calibrate import lumped_case
from twin.build.full_model import assemble
from twin.build.project import project
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.edit import edited
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.rom.apply import member_field, member_mean, with_values
from twin.rom.drive import evaluate
from twin.rom.rescale import rescaled
from twin.rom.tcp import tcp_rows


def everything(machine, seed: int) -> dict[str, float]:
    """A value for every parameter, half a prior standard deviation or so away."""
    rng = np.random.default_rng(seed)
    return {p.path: p.value(float(rng.uniform(-1.0, 1.0))) for p in parameters(machine)}


@pytest.mark.parametrize("seed", [0, 1])
def test_as_the_description_with_these_values(seed):
    machine = load_machine(lumped_case.FOLDER)
    text = (lumped_case.FOLDER / "machine.toml").read_text(encoding="utf-8")
    values = everything(machine, seed)
    other = load_machine(lumped_case.FOLDER, edited(text, values, digits=15))
    wanted = assemble(other).thermal
    got = with_values(assemble(machine).thermal, parameters(machine), values)
    for a, b in zip(got.bodies, wanted.bodies, strict=True):
        assert abs(a.E - b.E).max() < 1e-9 * abs(b.E).max()
        np.testing.assert_allclose(a.energy, b.energy, rtol=1e-12)
        np.testing.assert_allclose(a.G, b.G, rtol=1e-9, atol=1e-12 * abs(b.G).max(initial=1e-30))
    between = np.random.default_rng(seed).uniform(-0.1, 0.3, (5, len(got.pose_axes)))
    for a, b in zip(tcp_rows(got, between), tcp_rows(wanted, between), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12 * abs(b).max(initial=1e-30))
    for kind in ("sources", "films", "joints", "pairs", "environments"):
        for a, b in zip(getattr(got.load_model, kind), getattr(wanted.load_model, kind), strict=True):
            for name in {"gain", "conductance", "offset"} & set(vars(a)):
                assert getattr(a, name) == pytest.approx(getattr(b, name), rel=1e-12), (kind, a)


def test_a_projection_of_the_other_model_is_the_projection_with_other_values():
    machine = load_machine(lumped_case.FOLDER)
    full, values = assemble(machine).thermal, everything(machine, 2)
    rng = np.random.default_rng(0)
    other = with_values(full, parameters(machine), values)
    for k, body in enumerate(full.bodies):
        V = np.column_stack([body.one, rng.standard_normal((body.n, max(1, body.n // 2)))])
        L = np.linalg.cholesky(V.T @ (body.E @ V))
        V = V @ np.linalg.inv(L).T
        small = project(body, V)
        from dataclasses import replace

        alone = with_values(replace(full, bodies=(small,)), parameters(machine), values).bodies[0]
        np.testing.assert_allclose(alone.E, V.T @ (other.bodies[k].E @ V), atol=1e-12)
        np.testing.assert_allclose(alone.G, other.bodies[k].G @ V, atol=1e-18)
        np.testing.assert_allclose(alone.W, other.bodies[k].W @ V, atol=1e-12)


def test_members_share_out_the_body():
    for body in lumped_case.artefact().model.bodies:
        np.testing.assert_allclose(body.E_members.sum(axis=0), body.E, atol=1e-12)
        np.testing.assert_allclose(body.G_members.sum(axis=0), body.G, atol=1e-18)
        fields = np.array([member_field(body, m) for m in range(len(body.members))])
        np.testing.assert_allclose(fields.sum(axis=0), body.one, atol=1e-10)
        means = np.array([member_mean(body, m) for m in range(len(body.members))])
        np.testing.assert_allclose(means @ fields.T, np.eye(len(fields)), atol=1e-10)


def test_a_rescaled_drive_is_the_drive_of_the_other_model():
    a = lumped_case.artefact()
    (folder,) = [f for f in (lumped_case.FOLDER / "runs").iterdir() if f.is_dir()]
    run = read_run(folder)
    values = {p.path: p.value(0.7) for p in a.parameters if p.kind != "environment"}
    other = with_values(a.model, a.parameters, values)
    signals = signal_values(run, a.model.load_model.signals)
    nominal = evaluate(a.model.load_model, run.loads.time, signals, 60.0)
    wanted = evaluate(other.load_model, run.loads.time, signals, 60.0)
    got = rescaled(nominal, a.model.load_model, other.load_model)
    for name in ("power", "theta", "environment", "conductance", "contact_heat"):
        np.testing.assert_allclose(getattr(got, name), getattr(wanted, name), rtol=1e-12, atol=1e-12, err_msg=name)
    np.testing.assert_allclose(got.films.value, wanted.films.value, rtol=1e-12)
    np.testing.assert_allclose(got.losses.value, wanted.losses.value, rtol=1e-12)


def test_an_unknown_path_is_refused():
    a = lumped_case.artefact()
    with pytest.raises(KeyError, match="nothing"):
        with_values(a.model, a.parameters, {"sources.nothing.gain": 1.0})
