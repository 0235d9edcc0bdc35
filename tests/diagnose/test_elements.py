"""Elementary causes and readings: each once, each a column, of the size that its unit promises."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.calibrate.fit.measured import measured
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.faults import coolant
from twin.diagnose.faults.acted import units_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.context import Context
from twin.diagnose.faults.elements import elements_of, histories_of
from twin.diagnose.faults.readings import readings_of
from twin.diagnose.model.bank import nominal_run
from twin.diagnose.model.study import Study, make_study

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def read():
    """Readings of the fitted runs with their index, and the nominal outputs."""
    study = small_case.study()
    x = np.zeros(len(study.probed.parameters))
    outputs = [study.outputs(k, x) for k in study.fitted]
    J = [study.jacobian(k, x)[:, : len(x)] for k in study.fitted]
    return *readings_of(study, small_case.nominal()[:2], outputs, J), outputs, J


def test_every_column_has_one_name():
    elements = small_case.elements()
    assert sorted(elements.index.values()) == list(range(len(elements.columns)))
    kinds = {kind for kind, _, _ in elements.index}
    assert {"heat", "film", "group", "zone", "air", "joint", "contact", "capacity", "source", "start"} <= kinds
    assert all(len(c.histories) == 3 for c in elements.columns)


def test_every_reading_has_one_name(read):
    columns, index, _, _ = read
    assert sorted(index.values()) == list(range(columns.shape[1]))
    assert np.isfinite(columns).all()
    assert not set(index) & set(small_case.elements().index)


def test_runs_with_and_without_tcp_rows_have_readings_together():
    probed, runs = small_case.probed(), [small_case.runs()[0], replace(small_case.runs()[1], tcp=None)]
    plans = [measured(probed.base, run, b.drive, b.name) for run, b in zip(runs, probed.runs[:2], strict=True)]
    study = make_study(replace(probed, runs=probed.runs[:2]), plans, range(2))
    x = np.zeros(len(study.probed.parameters))
    outputs = [study.outputs(k, x) for k in study.fitted]
    J = [study.jacobian(k, x)[:, : len(x)] for k in study.fitted]
    columns, index = readings_of(study, small_case.nominal()[:2], outputs, J)
    assert np.isfinite(columns).all()
    assert {"drift", "slip", "step"} <= {kind for kind, _, _ in index}


def test_histories_are_of_order_one_and_the_same_signal_once():
    histories = small_case.elements().histories
    for name, values in {**histories.signals, **histories.speeds}.items():
        assert max(v.max() for v in values) == pytest.approx(1.0, abs=1e-9), name
    assert "spindle_current^2" in histories.signals
    assert not any(name.startswith("x_position") for name in histories.signals)
    # blocks fill the fitted runs and leave the sealed one alone
    for k in (0, 1):
        own = [(a, b) for i, a, b in histories.blocks if i == k]
        assert own[0][0] == 0
        assert own[-1][1] == small_case.study().runs[k].run.drive.n_steps
        assert all(a[1] == b[0] for a, b in pairwise(own))
    assert {i for i, _, _ in histories.blocks} == {0, 1}


def test_sensor_faults_touch_one_sensor(read):
    columns, index, outputs, _ = read
    study = small_case.study()
    first = study.runs[0].size
    for kind in ("offset", "drift", "lag", "detached"):
        T, w = study.runs[0].split(columns[:first, index[kind, "housing", "always"]])
        assert T[:, 1].any(), kind
        assert not T[:, [0, 2]].any()
        assert not w.any()
    hours = study.runs[0].measured.bin_time
    T, _ = study.runs[0].split(columns[:first, index["drift", "housing", "always"]])
    np.testing.assert_allclose(T[:, 1], hours / 86400.0, rtol=1e-5)
    # two swapped sensors show what the other showed
    T, _ = study.runs[0].split(columns[:first, index["swapped", "front<>housing", "always"]])
    own, _ = study.runs[0].split(outputs[0])
    np.testing.assert_allclose(T[:, 0], own[:, 1] - own[:, 0], atol=1e-5)
    np.testing.assert_allclose(T[:, 0], -T[:, 1])


def test_a_sensor_on_another_node_is_as_warm_as_that(read):
    columns, index, outputs, _ = read
    study = small_case.study()
    T, w = study.runs[0].split(columns[: study.runs[0].size, index["elsewhere", "front>housing", "always"]])
    own, _ = study.runs[0].split(outputs[0])
    np.testing.assert_allclose(T[:, 0], own[:, 1] - own[:, 0], atol=1e-5)
    assert not T[:, 1:].any()
    assert not w.any()
    nodes = {p.name for p in study.probed.places}
    assert {p for kind, p, _ in index if kind == "elsewhere" and p.startswith("front>")} == {
        f"front>{name}" for name in nodes - {"bearing_front"}
    }


def test_a_gain_is_a_declared_parameter(read):
    columns, index, _, J = read
    study = small_case.study()
    for i, p in enumerate(small_case.described().probed.parameters):
        wanted = np.concatenate([jac[:, i] for jac in J]) / study.scale[i]
        np.testing.assert_allclose(columns[:, index["gain", p.path, "always"]], wanted, rtol=1e-5, atol=1e-12)


def test_tcp_causes_touch_the_tcp_alone(read):
    columns, index, _, _ = read
    study = small_case.study()
    plan = study.runs[1]
    own = columns[study.runs[0].size :]
    for (kind, place, _), c in index.items():
        if kind in ("slip", "probed", "step", "probe", "frame", "heated", "scale", "load", "expansion"):
            T, w = plan.split(own[:, c])
            assert not T.any(), (kind, place)
            if kind == "probe":
                np.testing.assert_allclose(w[:, "xyz".index(place[1])], plan.measured.tcp_time, rtol=1e-6)
    slips = [columns[:, index[kind, f"d{a}", "always"]] for a in "xz" for kind in ("slip", "probed")]
    assert all(s.any() and np.abs(s).max() <= 0.5 + 1e-6 for s in slips)


def test_every_family_lists_hypotheses_over_columns_that_exist(read):
    columns, of_reading, _, _ = read
    study, elements = small_case.study(), small_case.elements()
    first = len(elements.columns)
    index = {**elements.index, **{key: first + c for key, c in of_reading.items()}}
    context = Context(study, elements, index)
    empty = []
    for family in FAMILIES:
        batches = family.batches(context)
        if not batches:
            empty.append(family.name)
        for batch in batches:
            assert batch.family == family.name
            assert batch.columns.shape[0] == len(batch.places)
            assert batch.columns.max() < first + columns.shape[1]
            for when in batch.histories:
                assert when.weights.shape == (batch.q, batch.columns.shape[1]), (family.name, when.name)
                assert all(0.0 <= w.start < w.end for w in when.windows)
    assert empty == ["coarse_model", "missing_member", "missing_joint"]  # judged otherwise, or after all others


def with_valve(values: Sequence[np.ndarray]) -> Study:
    """The study with a logged signal of these values (n,) in each run."""
    study = small_case.study()
    base = study.probed.base
    valve = replace(base.load_model.signals[0], name="valve", unit="1", low=0.0, high=1.0)
    load = replace(base.load_model, signals=(*base.load_model.signals, valve))
    runs = tuple(
        replace(p, run=replace(p.run, signals={**p.run.signals, "valve": own}))
        for p, own in zip(study.runs, values, strict=True)
    )
    return replace(study, probed=replace(study.probed, base=replace(base, load_model=load)), runs=runs)


def test_a_valve_is_a_switch_and_what_has_many_levels_is_none():
    steps = [p.run.drive.n_steps for p in small_case.study().runs]
    valve = [np.arange(n) % 60 < 25.5 for n in steps]
    some = [np.where(np.arange(n) % 60 == 25, 0.4, own) for n, own in zip(steps, valve, strict=True)]  # of a step
    ramp = [np.arange(n) % 60 / 60.0 for n in steps]
    assert histories_of(with_valve(some)).switches == ("valve",)
    assert histories_of(with_valve(ramp)).switches == ()
    assert histories_of(with_valve([np.ones(n) for n in steps])).switches == ()  # always on: no valve


def test_a_coolant_flows_while_a_valve_is_open():
    """A film and its heat with the history of the signal, in the sealed run, too."""
    steps = [p.run.drive.n_steps for p in small_case.study().runs]
    valve = [(np.arange(n) % 60 < 25).astype(float) for n in steps]
    study = with_valve(valve)
    elements = elements_of(study, [nominal_run(small_case.study(), k) for k in range(len(steps))])
    (batch,) = (b for b in coolant.batches(Context(study, elements, elements.index)) if b.histories[0].signal)
    assert [h.signal for h in batch.histories] == ["valve"]
    h = Hypothesis(batch, 0, batch.histories[0], 0.0, (60.0, -10.0))
    columns, weights = h.combination()
    assert columns.tolist() == [elements.index[kind, h.name, "valve"] for kind in ("film", "heat")]
    np.testing.assert_array_equal(weights, np.eye(2))
    for unit in units_of(study, h):
        for shape, own in zip(unit.shapes, valve, strict=True):
            np.testing.assert_allclose(shape, own)
