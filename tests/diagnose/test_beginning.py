"""Where a run begins that does not say so: what its sensors read first, and how far they are from each other."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from tests.diagnose.test_lumped import MACHINE, NULLS, loads, twin
from twin.diagnose.evidence.nulls import Form, start_of
from twin.diagnose.faults.elements import elements_of
from twin.diagnose.model.bank import nominal_run, respond
from twin.diagnose.model.beginning import Beginning, beginning_of
from twin.diagnose.model.first_field import FirstField, _network, first_field
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.study import start_of as start_of_run
from twin.logs.read import read_run
from twin.logs.run import Run, Table
from twin.logs.write import write_run
from twin.machine.load import load_machine
from twin.machine.parameters import parameters

HOUR = 3600.0


@pytest.fixture(scope="module")
def probed(tmp_path_factory):
    day = read_run(loads(tmp_path_factory.mktemp("beginning") / "day", 0))
    machine = load_machine(MACHINE)
    return make_probed_model(machine, parameters(machine), [day]), day


def begins(probed, temperatures: Table | None, **more: object) -> Beginning:
    model, day = probed
    run = replace(day, temperatures=temperatures, initial_temperature=None, **more)
    return beginning_of(model.base, run, model.runs[0].drive)


def table(**first: float) -> Table:
    time = np.arange(0.0, 2 * HOUR, 60.0)
    columns = {name: value + 30.0 * (time > 120.0) for name, value in first.items()}
    return Table(time, columns, dict.fromkeys(columns, "degC"))


def test_a_run_begins_as_it_says_else_as_its_sensors_read_first_else_as_its_air(probed):
    model, day = probed
    assert model.runs[0].begins == Beginning(20.0, stated=True)
    found = begins(probed, table(motor=24.0, head=23.0, column=22.0, air=19.0))
    assert found == Beginning(23.0, apart=pytest.approx((2.0 / 3.0) ** 0.5))
    air = day.loads.columns["air"][0]
    assert begins(probed, None) == begins(probed, table(foreign=40.0)) == Beginning(pytest.approx(air, abs=0.1))
    rested = begins(probed, table(motor=26.0), steady_start=True)
    assert (rested.stated, rested.rested, rested.temperature) == (True, True, pytest.approx(air, abs=0.1))
    assert rested.apart == pytest.approx(26.0 - rested.temperature)


def test_what_is_not_known_of_a_beginning_is_left_open():
    form = Form(start=0.1, start_apart=0.03)
    for begins, whole, part in (
        (Beginning(20.0, stated=True), 0.03, 0.03),
        (Beginning(20.0), 0.1, 0.03),
        (Beginning(23.0, apart=0.5), 0.5, 0.5),
        (Beginning(23.0, apart=7.0, field=FirstField(("motor", "head"), (9.0, 0.0), (1.5, 7.0))), 0.1, 1.5),
    ):
        assert start_of(begins, form) == whole
        assert start_of(begins, form, "motor") == part


def test_parts_of_a_warm_machine_begin_where_their_sensors_read_and_others_between(probed):
    """Nodes of motor, head and column read by sensors; what has none is beside them or near the air."""
    model, _ = probed
    found = begins(probed, table(motor=46.0, head=33.0, column=22.0))
    field = found.field
    assert found.temperature == 33.0
    told = {m: found.temperature + o for m, o in zip(field.members, field.offset, strict=True)}
    assert told == pytest.approx(told | {"motor": 46.0, "head": 33.0, "column": 22.0}, abs=0.01)
    others = [m for m in field.members if m not in ("motor", "head", "column")]
    assert all(15.0 < told[m] < 46.0 for m in others)
    assert all(found.spread(m) == found.apart for m in others)
    assert max(found.spread(m) for m in ("motor", "head", "column")) < found.apart
    z = start_of_run(model.base, replace(model.runs[0], begins=found))
    (body,) = model.base.bodies
    read = dict(zip(model.base.sensors, model.base.reference_temperature + body.C @ z, strict=True))
    assert read["motor"] == pytest.approx(46.0, abs=0.01)


def test_a_part_without_a_sensor_is_where_heat_balances(probed):
    """All but the head of a machine at rest are read, of which a heater keeps the motor warm: it is as they say."""
    model, drive = probed[0].base, probed[0].runs[0].drive
    K, b, C = _network(model, drive, 20.0)
    members = [m for body in model.bodies for m in body.members]
    true = np.linalg.solve(K, b + 300.0 * np.eye(len(K))[members.index("motor")])
    rest = {name: 20.0 + float(row @ true) for name, row in zip(model.sensors, C, strict=True) if name != "head"}
    found = first_field(model, drive, rest, 20.0)
    assert found.members == tuple(members)
    np.testing.assert_allclose(found.offset, true, atol=0.01)
    assert np.ptp(true) > 5.0


def test_a_sensor_says_where_its_own_part_begins_and_no_other(probed):
    """In a basis of few states its row has some of other parts, which would make up for it without bound."""
    model, drive = probed[0].base, probed[0].runs[0].drive
    read = {"motor": 46.0, "head": 33.0, "column": 22.0}
    bodies = tuple(replace(body, C=body.C + 0.02 * np.abs(body.C).max()) for body in model.bodies)
    assert first_field(replace(model, bodies=bodies), drive, read, 33.0) == first_field(model, drive, read, 33.0)


def test_another_temperature_at_the_start_is_in_the_first_row():
    """Of rows that count from the first one, the others had a step: it was heat of the first step."""
    study = small_case.study()
    nominal = [nominal_run(study, k) for k in range(len(study.runs))]
    elements = elements_of(study, nominal)
    column = elements.index["start", "run_0.machine", "always"]
    T, w = study.runs[0].split(respond(study, nominal, elements.vectors, [elements.columns[column]])[study.rows[0], 0])
    x, slots = np.zeros(len(study.scale)), study.slots(0)
    slots.initial[0] = elements.vectors[0][elements.columns[column].vector]
    exact_T, exact_w = study.runs[0].split(study.outputs(0, x, slots, (0.1,)) - study.outputs(0, x))
    np.testing.assert_allclose(T[:3], exact_T[:3] / 0.1, atol=0.03)
    np.testing.assert_allclose(w[0], exact_w[0] / 0.1, atol=0.03 * np.abs(w).max())
    assert np.abs(w[0]).max() > 0.0
    assert elements.columns[column].at_start


def later(run: Run, since: float) -> Run:
    """The run from a time on, of which nobody says where it begins."""

    def cut(t: Table) -> Table:
        kept = t.time >= since
        return replace(t, time=t.time[kept] - since, columns={n: v[kept] for n, v in t.columns.items()})

    return replace(run, loads=cut(run.loads), temperatures=cut(run.temperatures), tcp=None, initial_temperature=None)


@pytest.mark.slow
def test_a_machine_that_is_warm_from_the_hours_before_hides_nothing(tmp_path):
    """It was heat that is not described, and a sensor at fault."""
    twin("build", MACHINE, "-o", tmp_path / "four.h5")
    for seed, day in enumerate(("monday", "tuesday")):
        loads(tmp_path / f"{day}_loads", 4 * seed)
        twin("simulate", MACHINE, tmp_path / f"{day}_loads", "-o", tmp_path / f"{day}_whole", "--noise",
             "0.1 K", "--seed", seed)  # fmt: skip
        run = later(read_run(tmp_path / f"{day}_whole"), 2.5 * HOUR)
        first = [float(v[0]) for n, v in run.temperatures.columns.items() if n != "air"]
        assert np.ptp(first) > 3.0
        write_run(tmp_path / day, run)
    days = [tmp_path / day for day in ("monday", "tuesday")]
    twin("diagnose", tmp_path / "four.h5", *days, "-o", tmp_path / "found", *NULLS, "--no-build")
    found = json.loads((tmp_path / "found" / "report.json").read_text(encoding="utf-8"))
    assert (found["verdict"], found["causes"]) == ("nothing", [])
