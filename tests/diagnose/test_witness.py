"""Where all other channels refute one, the model is asked, too: what it explains as it was measured is no fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.calibrate.channels.finding import Finding
from twin.calibrate.channels.judge import Judgement, set_aside
from twin.calibrate.fit.measured import Measured, measured
from twin.diagnose.model.study import Study
from twin.diagnose.search.detector import emptied
from twin.diagnose.search.witness import upheld
from twin.logs.run import Run
from twin.rom.drive import measured_air

DRIFT, SURE, UNSURE = 2.0, 0.3, 1.0  # K, and half of the intervals of what is corrected and of what is set aside


def as_measured(drift: float, study: Study | None = None, more: np.ndarray | None = None) -> tuple[list[Run], str]:
    """The two fitted runs as the model has them, with noise; the first sensor drifts [K] through the first one.
    more (m,): what else acts on what is measured."""
    study, rng, made = study or small_case.study(), np.random.default_rng(5), []
    name = study.runs[0].measured.sensors[0]
    for k, run in enumerate(small_case.runs()[:2]):
        planned, table = study.runs[k], run.temperatures
        y = study.outputs(k, np.zeros(len(study.probed.parameters)))
        T, w = planned.split(y if more is None else y + more[study.rows[k]])
        tcp = replace(run.tcp, displacement=w + small_case.TCP_NOISE * rng.standard_normal(w.shape))
        time = table.time
        columns = {
            s: np.interp(time, planned.measured.bin_time, T[:, i]) + small_case.NOISE * rng.standard_normal(len(time))
            for i, s in enumerate(planned.measured.sensors)
        }
        if k == 0:
            columns[name] = columns[name] + drift * time / time[-1]
        made.append(replace(run, temperatures=replace(table, columns=columns), tcp=tcp))
    return made, name


def plans_of(runs: list[Run]) -> list[Measured]:
    study = small_case.study()
    return [measured(study.probed.base, run, p.run.drive, p.run.name) for run, p in zip(runs, study.runs, strict=True)]


def findings(name: str, runs: list[Run], half: float) -> tuple[Finding, Finding]:
    """A drift through the first run, by all other channels, and noise in the second, by rows of that run itself."""
    end = float(runs[0].temperatures.time[-1])
    told = Finding("drift", (name,), (0,), 0.0, end, DRIFT, (DRIFT - half, DRIFT + half), 80.0, 70.0)
    return told, replace(told, what="noise", runs=(1,), end=600.0, statistic=np.inf)


@pytest.mark.parametrize("half", [SURE, UNSURE])
@pytest.mark.parametrize("drift", [0.0, DRIFT])
def test_a_drift_that_the_model_explains_as_it_is_is_none(drift: float, half: float):
    runs, name = as_measured(drift)
    told, noise = findings(name, runs, half)
    judgement = Judgement((told, noise), (), ())
    plans = plans_of([*set_aside(runs, judgement.findings), *small_case.runs()[2:]])
    known = np.isfinite(plans[0].temperature[:, plans[0].sensors.index(name)])
    assert known.any() == (half == SURE)  # else no reading of that run is kept
    kept = upheld(emptied(small_case.made_detector(), plans), plans, runs, judgement)
    assert kept.findings == (judgement.findings if drift else (noise,))


def heat(place: str, watts: float) -> np.ndarray:
    """(m,) what heat at a place in the first half of the first run does to what is measured."""
    blocks = [b for b, (run, *_) in enumerate(small_case.elements().histories.blocks) if run == 0]
    columns = small_case.elements().heat_blocks[place][blocks[: len(blocks) // 2]]
    return watts * small_case.responses()[:, columns].astype(float).sum(axis=1)


@pytest.mark.parametrize("swapped", [False, True])
def test_two_channels_have_each_others_names_where_the_model_leaves_less_of_them_exchanged(swapped: bool):
    runs, _ = as_measured(0.0)
    a, b = small_case.study().runs[0].measured.sensors[:2]
    if swapped:
        tables = [(run, run.temperatures.columns) for run in runs]
        runs = [
            replace(run, temperatures=replace(run.temperatures, columns=own | {a: own[b], b: own[a]}))
            for run, own in tables
        ]
    end = float(runs[1].temperatures.time[-1])
    told = Finding("swapped", (a, b), (0, 1), -1.0, end, np.nan, (np.nan, np.nan), 80.0, 50.0)
    judgement = Judgement((told,), (), ())
    plans = plans_of([*set_aside(runs, judgement.findings), *small_case.runs()[2:]])
    kept = upheld(emptied(small_case.made_detector(), plans), plans, runs, judgement)
    assert kept.findings == ((told,) if swapped else ())


@pytest.mark.parametrize(
    ("log", "sensor", "watts", "stands"),
    [
        (0.0, 0.0, 0.0, False),
        (0.0, DRIFT, 0.0, True),
        (DRIFT, DRIFT, 0.0, True),
        # a cold housing looks like colder air; air that drifts is seen beside heat
        (0.0, 0.0, -300.0, False),
        (0.0, DRIFT, 50.0, True),
    ],
)
def test_air_is_as_measured_where_the_machine_felt_it(log: float, sensor: float, watts: float, stands: bool):
    """log, sensor: K by which what drives the model, and the sensor in that air, drift in the first run; watts: of heat
    at the housing that nothing else tells of."""
    study = small_case.study()
    base = study.probed.base
    ((name, e),) = base.ambient_sensors
    real, made = list(study.runs), list[Run]()
    ramp = np.linspace(0.0, log, study.runs[0].run.drive.n_steps)
    air = np.array(real[0].run.loads.environment)
    air[:, e] -= ramp
    real[0] = replace(real[0], run=replace(real[0].run, loads=replace(real[0].run.loads, environment=air)))
    clean, _ = as_measured(0.0, replace(study, runs=tuple(real)), heat("housing", watts))
    for k, run in enumerate(clean):
        table, drive = run.temperatures, study.runs[k].run.drive
        own = np.interp(table.time, drive.time[:-1], measured_air(base.load_model, drive)[:, e])
        if k == 0:
            own = own + (sensor - log) * table.time / table.time[-1]
        units = {**table.units, name: "degC"}
        made.append(replace(run, temperatures=replace(table, columns={**table.columns, name: own}, units=units)))
    told, noise = findings(name, made, UNSURE)
    judgement = Judgement((noise, told), (), ())
    plans = plans_of([*set_aside(made, judgement.findings), *small_case.runs()[2:]])
    kept = upheld(emptied(small_case.made_detector(), plans), plans, made, judgement)
    assert kept.findings == ((noise, told) if stands else (noise,))
