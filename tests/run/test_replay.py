"""Replays: outputs, flags, and restarts that give the very same numbers."""

import dataclasses

import numpy as np
import pytest
import synthetic
import synthetic_run
from dense_reference import Dense

from tests.calibrate import lumped_case
from twin.build.full_model import assemble
from twin.errors import LogError, TwinError
from twin.logs.read import read_run
from twin.logs.run import Run, Table
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact
from twin.rom.drive import evaluate
from twin.rom.poses import pose_weights
from twin.rom.tcp import by_body
from twin.run import replay as module
from twin.run.checkpoint import CheckpointFolder
from twin.run.replay import replay
from twin.run.results import summary

MODEL = synthetic.machine()
RUN = synthetic_run.run(MODEL)


@pytest.fixture(scope="module")
def artefact(tmp_path_factory):
    return read_artefact(synthetic_run.artefact(tmp_path_factory.mktemp("a") / "a.h5", MODEL))


@pytest.fixture(scope="module")
def result(artefact):
    return replay(artefact, RUN)


def test_outputs_are_those_of_the_dense_model(result):
    time, signals = synthetic.loads(MODEL.load_model, 3.0)
    drive = evaluate(MODEL.load_model, time, signals, 60.0)
    dense = Dense(MODEL, drive)
    states = dense.runge_kutta(dense.uniform(drive.environment[0, 0]))
    n = len(MODEL.sensors)
    np.testing.assert_allclose(result.temperature[:, :n], dense.temperature(states), rtol=1e-11)
    np.testing.assert_allclose(result.tcp, dense.tcp(states), rtol=1e-9, atol=1e-11 * np.abs(result.tcp).max())
    assert result.sensors == (*MODEL.sensors, "T_hall")
    np.testing.assert_array_equal(result.temperature[1:, n], drive.environment[:, 0])
    assert result.balance_error.max() <= 1e-8


def test_tcp_at_the_actual_position_is_that_of_the_pose_there(artefact):
    still = {name: np.full_like(v, 0.4) if name.endswith("_position") else v for name, v in RUN.loads.columns.items()}
    result = replay(artefact, dataclasses.replace(RUN, loads=Table(RUN.loads.time, still, RUN.loads.units)))
    (middle,) = np.flatnonzero((MODEL.poses == 0.4).all(axis=1))
    np.testing.assert_allclose(result.tcp_actual, result.tcp[:, middle], rtol=1e-11, atol=1e-18)


def test_tcp_at_the_actual_position_is_exact_where_the_artefact_has_its_structure():
    a, full = lumped_case.artefact(), assemble(load_machine(lumped_case.FOLDER))
    (folder,) = [f for f in (lumped_case.FOLDER / "runs").iterdir() if f.is_dir()]
    result = replay(a, read_run(folder))
    assert result.exact
    assert summary(result)["tcp"]["at_actual_position"] == "exact"
    # the artefact's states are the nodes' temperatures times the square roots of their capacities
    root = np.concatenate([np.sqrt(b.E.diagonal()) for b in full.thermal.bodies])
    fields = by_body(full.thermal, result.states / root)
    at = np.arange(0, len(result.time), 5)
    wanted = [full.structure.displacement(result.position[n], [f[n] for f in fields]) for n in at]
    np.testing.assert_allclose(result.tcp_actual[at], wanted, atol=1e-12)
    between = np.einsum("np,npc->nc", pose_weights(a.model.pose_grid, result.position)[0], result.tcp)
    assert np.abs(between[at] - wanted).max() > 1e-8


def test_old_artefacts_interpolate_and_say_so(result):
    assert not result.exact
    assert summary(result)["tcp"]["at_actual_position"] == "interpolated between the poses"
    weights, _ = pose_weights(MODEL.pose_grid, result.position[:, [result.axes.index(a) for a in MODEL.pose_axes]])
    between = np.einsum("np,npc->nc", weights, result.tcp)
    np.testing.assert_allclose(result.tcp_actual, between, rtol=1e-9, atol=1e-16)


def test_starts_where_it_is_told(artefact, result):
    assert result.temperature[0] == pytest.approx(20.0 + 2.0 * 30.0 / 3600.0, abs=0.01)  # the hall in the first minute
    warm = replay(artefact, RUN, initial=31.0)
    assert warm.temperature[0, :-1] == pytest.approx(31.0)
    known = replay(artefact, dataclasses.replace(RUN, initial_temperature=17.0))
    assert known.temperature[0, :-1] == pytest.approx(17.0)
    on = replay(artefact, RUN, initial=result.state)
    np.testing.assert_allclose(on.temperature[0, :-1], result.temperature[-1, :-1], rtol=1e-12)


class PowerCut(Exception):
    pass


def interrupt_after(monkeypatch, blocks):
    """Let the stepping fail like a power cut after some blocks."""
    original, left = module.advance, [blocks]

    def advance(*arguments):
        if left[0] == 0:
            raise PowerCut
        left[0] -= 1
        return original(*arguments)

    monkeypatch.setattr(module, "advance", advance)


def equal(a, b):
    return [
        f.name
        for f in dataclasses.fields(a)
        if isinstance(getattr(a, f.name), np.ndarray) and not np.array_equal(getattr(a, f.name), getattr(b, f.name))
    ]


@pytest.mark.parametrize("blocks", [1, 2])
@pytest.mark.parametrize("every", [64, 100])
def test_restart_is_exact_to_the_bit(artefact, result, tmp_path, monkeypatch, blocks, every):
    with monkeypatch.context() as patched:
        interrupt_after(patched, blocks)
        with pytest.raises(PowerCut):
            replay(artefact, RUN, checkpoints=CheckpointFolder(tmp_path / "c", every, resume=False))
    saved = len(list((tmp_path / "c").glob("*.h5"))) if (tmp_path / "c").exists() else 0
    assert saved == (blocks if every == 64 else blocks // 2)
    calls = []
    with monkeypatch.context() as patched:
        original = module.advance
        patched.setattr(module, "advance", lambda *a: calls.append(1) or original(*a))
        replay(artefact, RUN)
        total = len(calls)
        again = replay(artefact, RUN, checkpoints=CheckpointFolder(tmp_path / "c", every, resume=True))
    assert len(calls) - total == total - (saved if every == 64 else 2 * saved)  # finished steps are not stepped again
    assert equal(again, result) == []


def test_a_log_that_has_grown_keeps_its_checkpoints(artefact, result, tmp_path):
    short = Table(RUN.loads.time[:1200], {k: v[:1200] for k, v in RUN.loads.columns.items()}, RUN.loads.units)
    folder = tmp_path / "c"
    replay(artefact, dataclasses.replace(RUN, loads=short), checkpoints=CheckpointFolder(folder, 64, False))
    assert len(list(folder.glob("*.h5"))) == 2
    again = replay(artefact, RUN, checkpoints=CheckpointFolder(folder, 64, True))
    assert equal(again, result) == []


def test_checkpoints_of_another_run_are_refused(artefact, tmp_path):
    folder = tmp_path / "c"
    replay(artefact, RUN, checkpoints=CheckpointFolder(folder, 64, False))
    with pytest.raises(TwinError, match="another run"):
        replay(artefact, RUN, initial=25.0, checkpoints=CheckpointFolder(folder, 64, True))
    with pytest.raises(TwinError, match="another run"):
        replay(artefact, RUN, substeps=2, checkpoints=CheckpointFolder(folder, 64, True))
    first = min(folder.glob("*.h5"))
    first.write_bytes(first.read_bytes()[:1000])
    with pytest.raises(TwinError, match="not a checkpoint"):
        replay(artefact, RUN, checkpoints=CheckpointFolder(folder, 64, True))


def test_flags_of_the_runtime(artefact, result):
    def raised(r):
        return {name for k, name in enumerate(r.flag_names) if r.flags[:, k].any()}

    assert raised(result) == set()
    assert raised(replay(artefact, RUN, dt=30.0)) == set()
    assert raised(replay(artefact, RUN, dt=10.0)) == {"substep shorter than the certified 15 s"}
    position = RUN.loads.columns["x_position"] * 0.9 / 0.8
    beyond = raised(replay(artefact, synthetic_run.run(MODEL, x_position=position)))
    assert {"axes.x beyond its stroke", "position outside the pose grid, TCP error of its border"} <= beyond


def test_a_missing_signal_is_named(artefact):
    columns = {name: v for name, v in RUN.loads.columns.items() if name != "y_current"}
    with pytest.raises(LogError) as caught:
        replay(artefact, Run(Table(RUN.loads.time, columns, {name: RUN.loads.units[name] for name in columns})))
    assert "y_current" in str(caught.value)
