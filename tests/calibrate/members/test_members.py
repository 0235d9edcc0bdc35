"""A body that nobody described is found by what it follows; nothing is named where nothing is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.calibrate.members import planted, planted_box
from twin.build.full_model import assemble
from twin.build.pipeline import rich_model
from twin.build.rich_basis import RichOptions
from twin.calibrate.members.describe import Member, with_members
from twin.calibrate.members.driver import Driver, drivers_of
from twin.calibrate.members.evidence import Sums, explain, held_out, total, with_noise
from twin.calibrate.members.find import beside_model, left_by
from twin.calibrate.members.responses import Candidate, candidates, responses
from twin.machine.edit import edited
from twin.machine.extend import removed
from twin.machine.parameters import parameters
from twin.rom.artefact import Artefact
from twin.run.replay import replay


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    real = planted.machine(tmp_path_factory.mktemp("real"), planted.hidden())
    return [planted.measured(real, seed) for seed in range(4)]


@pytest.fixture(scope="module")
def found(runs, tmp_path_factory):
    return beside_model(planted.artefact(tmp_path_factory.mktemp("described")), runs[:3])


@pytest.mark.long
def test_the_wall_is_named_and_the_door_is_not(found):
    named = [j.name for j in found.selected.named]
    assert "wall" in named
    assert "door" not in named
    assert (found.selected.held_out[1:] < 0.5 * found.selected.alone[1:]).all()


@pytest.mark.long
def test_a_complete_description_misses_nobody(tmp_path, runs):
    real = planted.machine(tmp_path / "real", planted.TEXT)
    whole = [planted.measured(real, seed) for seed in range(3)]
    assert not beside_model(planted.artefact(tmp_path / "d"), whole).selected.named


@pytest.mark.long
def test_extension_predicts_a_run_that_it_has_not_seen(found, runs, tmp_path):
    text = with_members(edited(planted.TEXT, found.expansions), found.members, found.selected.explained.scale, runs[:3])
    sealed = runs[3]
    errors = {}
    for name, description in (("before", planted.TEXT), ("after", text)):
        result = replay(planted.artefact(tmp_path / name, description), sealed, 60.0)
        w = np.column_stack([np.interp(sealed.tcp.time, result.time, v) for v in result.tcp_actual.T])
        errors[name] = np.sqrt(np.mean((sealed.tcp.displacement - (w - w[0])) ** 2, axis=0))
    assert (errors["after"][1:] < 0.4 * errors["before"][1:]).all()
    assert removed(with_members(planted.TEXT, found.members, 1e-6, runs[:3])) == planted.TEXT


def test_beside_parts_the_rows_are_no_parameters():
    member = Member(Candidate(Driver("wall", "degC"), 1200.0), np.array([np.nan, 1e-6, 1e-6]))
    text = with_members('[parts.bed]\nmesh = "bed.msh"\n', [member], 1e-6, [planted.loads(0)])
    assert "[nodes.follows_wall_20min]" in text
    assert "tcp.expansion.follows" not in text


def test_response_is_the_exact_lag_of_a_step():
    run = planted.loads(0)
    table = run.loads
    step = np.where(table.time >= 3600.0, 25.0, 20.0)
    run = replace(run, loads=replace(table, columns={**table.columns, "wall": step}))
    late = np.array([3600.0, 7200.0, 20000.0])
    (rise,) = responses(run, [Candidate(Driver("wall", "degC"), 1200.0)], late + 30.0).T
    # the reading runs straight over the minute before the step: half a minute early
    np.testing.assert_allclose(rise, 5.0 * (1.0 - np.exp(-(late + 60.0 - 3600.0) / 1200.0)), atol=0.02)


def test_heat_is_felt_with_a_lag_only():
    tried = candidates(drivers_of([planted.loads(0), planted.loads(1)]))
    assert {c.driver.column for c in tried} == {"speed", "air", "wall", "door"}
    assert min(c.lag for c in tried if not c.driver.is_temperature) > 60.0


def test_evidence_is_that_of_the_gaussian():
    """Against the density of y with its full covariance, for one axis and all weights one row each."""
    rng = np.random.default_rng(1)
    k, c, n, scale, noise = 40, 3, 2, 0.7, 0.3
    F, J, y = rng.standard_normal((k, c)), rng.standard_normal((k, 1, n)), rng.standard_normal((k, 1))
    sums = Sums.of(y, J, F)
    weight = sums.rows[0] / k
    found = explain(sums, range(c), scale, np.array([noise]))
    # rows of weight w are rows of variance noise^2 / w; of the normalisation only the share w of each row counts
    Y = np.eye(k) * noise**2 / weight + scale**2 * F @ F.T + J[:, 0] @ J[:, 0].T
    sign, logdet = np.linalg.slogdet(Y)
    log = -0.5 * (y[:, 0] @ np.linalg.solve(Y, y[:, 0]) + logdet) + 0.5 * k * np.log(noise**2 / weight)
    assert sign > 0
    assert found.log_evidence == pytest.approx(log - weight * k * np.log(noise), rel=1e-9)


def test_noise_is_found():
    """Rows as far apart as they remember: so many witnesses as rows."""
    rng = np.random.default_rng(2)
    n = round(1.0 / Sums.of(np.zeros((1, 1)), np.zeros((1, 1, 0)), np.zeros((1, 1))).rows[0])  # rows of a witness
    F = np.repeat(rng.standard_normal((400, 4)), n, axis=0)
    y = F @ rng.standard_normal(4) * 1e-6 + np.repeat(2e-6 * rng.standard_normal(400), n)
    sums = Sums.of(y[:, None], np.zeros((400 * n, 1, 0)), F)
    assert with_noise(sums, range(4), 1e-6).noise[0] == pytest.approx(2e-6, rel=0.15)


def test_held_out_rows_are_not_seen():
    rng = np.random.default_rng(3)
    parts = [
        Sums.of(rng.standard_normal((50, 2)), np.zeros((50, 2, 0)), rng.standard_normal((50, 5))) for _ in range(3)
    ]
    noise = np.ones(2)
    one = explain(total(parts[1:]), range(5), 1.0, noise).left(parts[0])
    every = held_out(parts, range(5), 1.0, noise)
    rest = [
        explain(total([p for j, p in enumerate(parts) if j != i]), range(5), 1.0, noise).left(parts[i])
        for i in range(3)
    ]
    np.testing.assert_allclose(every, np.sqrt(np.mean(np.square(rest), axis=0)))
    assert (one > 0.0).all()


@pytest.mark.slow
def test_beside_a_machine_of_parts(tmp_path):
    """What follows the wall is named beside parts, too, and what is written computes what was found."""
    machine = planted.machine(tmp_path / "box", planted_box.TEXT)
    real = planted.machine(tmp_path / "real", planted_box.hidden())
    runs = [planted.measured(real, seed) for seed in range(2)]
    bare = artefact_of(machine, planted_box.TEXT)
    found = beside_model(bare, runs)
    assert "wall" in [j.name for j in found.selected.named]
    assert "door" not in [j.name for j in found.selected.named]
    text = edited(planted_box.TEXT, found.expansions)
    text = with_members(text, found.members, found.selected.explained.scale, runs)
    extended = artefact_of(planted.machine(tmp_path / "extended", text), text)
    for run, expected in zip(runs, left_by(found, bare, runs), strict=True):
        left = []
        for artefact in (bare, extended):
            result = replay(artefact, run, 60.0)
            w = np.column_stack([np.interp(run.tcp.time, result.time, v) for v in result.tcp_actual.T])
            left.append(np.sqrt(np.mean((run.tcp.displacement - (w - w[0])) ** 2, axis=0)))
        np.testing.assert_allclose(left[1], expected, atol=0.1e-6)
        assert (left[1][1:] < 0.3 * left[0][1:]).all()


def artefact_of(machine, text):
    rich = rich_model(machine, assemble(machine), RichOptions(samples=6))
    return Artefact(rich, text, {}, {}, (), parameters(machine), "", machine.machine.name)
