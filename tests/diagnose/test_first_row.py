"""Runs whose TCP counts from its first row: causes that act on what is read change them as damaged logs do."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.calibrate.fit.measured import measured
from twin.diagnose.evidence.batch import Batch, History, Hypothesis
from twin.diagnose.evidence.nulls import Instruments, null
from twin.diagnose.faults.readings import LAGS, late, play, readings_of
from twin.diagnose.model.study import Study, make_study
from twin.diagnose.search.detector import first_rows
from twin.diagnose.search.gain import _read
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import damaged
from twin.logs.run import Run

pytestmark = pytest.mark.long

SIZE = 4e-6  # m
EVERY = 2400.0  # s, between measurements of three rows
KINDS = ("scale", "expansion", "slip", "probed", "step", "probe", "frame", "heated", "load")


@cache
def runs(reference: str = "first", lost: bool = False) -> tuple[Run, ...]:
    """The runs of the small case with three TCP rows a minute apart; lost: the first one is empty."""
    made = []
    for run in small_case.runs():
        rows = (np.arange(EVERY, run.loads.time[-1], EVERY)[:, None] + [0.0, 60.0, 120.0]).ravel()
        rng = np.random.default_rng(7)
        displacement = 5e-6 * rng.standard_normal((len(rows), 3))
        if reference == "first":
            displacement -= displacement[0]
        if lost:
            displacement[0] = np.nan
        tcp = replace(run.tcp, time=rows, position=rng.uniform(-0.1, 0.3, (len(rows), 1)), displacement=displacement,
                      sigma=None)  # fmt: skip
        made.append(replace(run, tcp=tcp, tcp_reference=reference))
    return tuple(made)


def planned(of: tuple[Run, ...]) -> Study:
    """The study of these runs, two of them fitted."""
    probed = small_case.probed()
    return make_study(
        probed, [measured(probed.base, r, b.drive, b.name) for r, b in zip(of, probed.runs, strict=True)], (0, 1)
    )


def zeros(study: Study) -> np.ndarray:
    return np.zeros(len(study.probed.parameters))


@cache
def read(reference: str = "first", lost: bool = False) -> tuple[Study, np.ndarray, dict]:
    """The study, its reading columns, and where each is."""
    study = planned(runs(reference, lost))
    J = [study.jacobian(k, zeros(study))[:, : len(zeros(study))] for k in study.fitted]
    outputs = [study.outputs(k, zeros(study)) for k in study.fitted]
    return study, *readings_of(study, small_case.nominal()[:2], outputs, J)


def tcp_of(study: Study, y: np.ndarray) -> list[np.ndarray]:
    """(k, 3) of each fitted run."""
    parts, first = [], 0
    for k in study.fitted:
        parts.append(study.runs[k].split(y[first : first + study.runs[k].size])[1])
        first += study.runs[k].size
    return parts


def from_first(study: Study, y: np.ndarray) -> np.ndarray:
    return np.concatenate([(w - w[0]).ravel() for w in tcp_of(study, y)])


def flat(study: Study, y: np.ndarray) -> np.ndarray:
    return np.concatenate([w.ravel() for w in tcp_of(study, y)])


def told(study: Study) -> np.ndarray:
    """What is measured of the TCP in the fitted runs."""
    return np.concatenate([study.runs[k].measured.tcp.ravel() for k in study.fitted])


LOST_TOO = ("step", "drift", "frame", "load")  # of "heating", a row that is lost moves the first one of a measurement


@pytest.mark.parametrize(
    ("kind", "lost"), [("heating", False), *((k, lost) for k in LOST_TOO for lost in (False, True))]
)
def test_a_reading_changes_as_a_damaged_log_does(kind, lost):
    study, columns, index = read("first", lost)
    whole = runs("first", lost)
    rows, top = whole[0].tcp.time, float(whole[0].loads.columns["spindle_current"].max())
    damage, key, amplitude = {
        "step": (
            Damage("not_thermal", "tcp.dx", SIZE, kind, start=2 * EVERY),
            ("step", "dx", f"0:{2 * EVERY:.0f}"), SIZE,
        ),
        "drift": (Damage("measurement", "tcp.dx", SIZE, kind), ("probe", "dx", "always"), SIZE / (rows[-1] - rows[0])),
        "frame": (Damage("measurement", "tcp.dx:x", 1e-4, kind), ("frame", "dx:x", "always"), 1e-4),
        "heating": (Damage("measurement", "tcp.dx", SIZE, kind), ("heated", "dx", "always"), SIZE),
        "load": (
            Damage("not_thermal", "tcp.dx", SIZE, kind, signal="spindle_current"),
            ("load", "dx:spindle_current", "always"), SIZE / top,
        ),
    }[kind]  # fmt: skip
    change = told(planned((damaged(whole[0], damage), *whole[1:]))) - told(study)
    n = study.runs[0].measured.tcp.size
    assert np.abs(change[:n]).max() > 0.1 * SIZE
    np.testing.assert_allclose(amplitude * flat(study, columns[:, index[key]])[:n], change[:n], atol=1e-6 * SIZE)
    if kind == "step":  # it has come to stay, and a later run counts from its own first row
        assert not flat(study, columns[:, index[key]])[n:].any()


def test_a_play_of_the_measuring_device_leaves_what_a_damaged_log_does():
    study, _, _ = read()
    split = [study.runs[k].split(study.outputs(k, zeros(study)))[1] for k in range(3)]
    whole = tuple(replace(r, tcp=replace(r.tcp, displacement=w)) for r, w in zip(runs(), split, strict=True))
    width = 0.5 * float(np.ptp(split[0][:, 0]))
    after = planned((*(damaged(r, Damage("slip", "tcp.dx", width, "play")) for r in whole[:2]), whole[2]))
    change = told(after) - told(planned(whole))
    of_kind = {kind: width * flat(study, play(study, lambda k: small_case.nominal()[k].states, kind, "dx", width))
               for kind in LAGS}  # fmt: skip
    top = np.abs(change).max()
    assert top > 0.2 * width
    np.testing.assert_allclose(of_kind["probed"], change, atol=1e-2 * top)  # rows are between steps
    assert np.abs(of_kind["slip"] - change).max() > 0.1 * top  # moved before the first measurement, too


@pytest.mark.parametrize("seconds", [-60.0, 90.0])
def test_a_late_clock_leaves_what_it_is_said_to(seconds):
    study, _, _ = read()
    split = [study.runs[k].split(study.outputs(k, zeros(study)))[1] for k in range(3)]
    whole = tuple(
        replace(r, tcp=replace(r.tcp, displacement=w)) for r, w in zip(runs(), split, strict=True)
    )  # what the machine does
    stamped = damaged(whole[0], Damage("signal", "run", seconds, "clock"))
    after = planned((stamped, *whole[1:]))
    left = told(after) - flat(after, np.concatenate([after.outputs(k, zeros(after)) for k in after.fitted]))
    said = seconds * flat(after, late(after, {0: small_case.nominal()[0].states}, seconds))
    assert np.abs(said).max() > 0.0
    np.testing.assert_allclose(said, left, atol=1e-3 * np.abs(left).max())


def test_every_reading_of_the_tcp_counts_from_the_first_row():
    study, columns, index = read()
    absolute, before, of = read("absolute")
    assert index == of
    touched = set()
    for (kind, _, _), c in index.items():
        if kind in (*KINDS, "clock"):
            wanted = from_first(absolute, before[:, c].astype(float))
            found = flat(study, columns[:, c])
            np.testing.assert_allclose(found, wanted, atol=1e-6 * max(np.abs(before[:, c]).max(), 1e-12), err_msg=kind)
            touched |= {kind} if np.abs(found).max() > 0.0 else set()
    assert touched == {kind for kind, _, _ in index} & {*KINDS, "clock"}
    nominal = small_case.nominal()
    for width in (1e-6, 8e-6):
        for kind in LAGS:
            wanted = from_first(absolute, play(absolute, lambda k: nominal[k].states, kind, "dz", width))
            now = play(study, lambda k: nominal[k].states, kind, "dz", width)
            np.testing.assert_allclose(flat(study, now), wanted, atol=1e-12)
    states = {0: nominal[0].states}
    wanted = from_first(absolute, late(absolute, states, 600.0))
    np.testing.assert_allclose(flat(study, late(study, states, 600.0)), wanted, atol=1e-18)


@pytest.mark.parametrize(
    ("kind", "name"), [("probe", "tcp.dx"), ("frame", "tcp.dy:x"), ("slip", "tcp.dz"), ("probed", "tcp.dz")]
)
def test_a_sealed_run_that_counts_from_its_first_row_does_so_in_what_is_predicted(kind, name):
    always = History("always", np.ones((1, 1)))
    batch = Batch("", kind, "", (name,), np.zeros((1, 1), dtype=int), (always,))
    cause = SimpleNamespace(hypothesis=Hypothesis(batch, 0, always, 1.0, (SIZE,)), amplitude=np.array([SIZE]), units=())
    added = []
    for reference in ("first", "absolute"):
        study = read(reference)[0]
        detector = SimpleNamespace(study=study, nominal=small_case.nominal())
        found = SimpleNamespace(detector=detector, accepted=(cause,), x=zeros(study))
        added.append(study.runs[2].split(_read(found, 2))[1])
    assert np.abs(added[0]).max() > 0.0
    assert not added[0][0].any()
    np.testing.assert_allclose(added[0], added[1] - added[1][0], atol=1e-6 * np.abs(added[1]).max())


@pytest.mark.parametrize("reference", ["first", "absolute"])
def test_the_noise_of_the_first_row_is_in_all_others(reference):
    """Of each run its own, and in none that does not count from it; in measurements without a cause, too."""
    study, tcp = planned(runs(reference)), 4e-6
    columns = first_rows(study, tcp)
    if reference == "absolute":
        assert columns.shape == (study.rows[-1].stop, 0)
        return
    assert columns.shape[1] == 6
    for r, (_, T, w) in enumerate(study.split(columns)):
        assert not T.any()
        own, other = w[:, :, 3 * r : 3 * r + 3], np.delete(w, range(3 * r, 3 * r + 3), axis=2)
        np.testing.assert_array_equal(own[1:], np.broadcast_to(tcp * np.eye(3), own[1:].shape))
        assert not own[0].any()
        assert not other.any()
    J = [np.zeros((study.runs[k].size, len(zeros(study)))) for k in study.fitted]
    drawn = [null(study, J, seed, Instruments(tcp=tcp)) for seed in range(40)]
    of_first = [w for y in drawn for _, _, w in study.split(y)]
    assert not any(w[0].any() for w in of_first)
    quiet = [null(study, J, seed, Instruments(tcp=1e-12)) for seed in range(40)]
    errors = np.array([(a - b)[1:] for y, z in zip(drawn, quiet, strict=True)
                       for (_, _, a), (_, _, b) in zip(study.split(y), study.split(z), strict=True)])  # fmt: skip
    assert np.std(errors.mean(axis=1)) == pytest.approx(tcp, rel=0.3)  # that of one row, in all of them
