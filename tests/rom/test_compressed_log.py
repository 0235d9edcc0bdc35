"""A log compressed for a slow link heats the machine as its samples do (paper 001, erratum E-001-4)."""

import numpy as np
import pytest
import synthetic

from twin.logs.compress import compress_loads
from twin.logs.run import Table
from twin.rom.drive import evaluate

LOAD = synthetic.load_model()
UNITS = {s.name: s.unit for s in LOAD.signals}


def rough(seconds: float = 600.0, sampling: float = 0.05) -> Table:
    """Currents and speeds that change from sample to sample, positions that run."""
    rng = np.random.default_rng(2)
    time = np.arange(0.0, seconds, sampling)
    columns = {}
    for name, unit in UNITS.items():
        noise = rng.random(len(time))
        columns[name] = {"degC": 20.0 + noise, "A": 15.0 * noise * (noise > 0.7), "m/s": noise - 0.5}.get(
            unit, 0.4 + 0.3 * np.sin(time / 9.0)
        )
    return Table(time, columns, UNITS)


@pytest.mark.parametrize("mean", [1.0, 10.0, 60.0])
def test_powers_of_every_step_are_those_of_the_samples(mean):
    samples = rough()
    means = compress_loads(samples, mean)
    ours = evaluate(LOAD, means.time, means.columns, 60.0, 10)
    exact = evaluate(LOAD, samples.time, samples.columns, 60.0, 10)
    np.testing.assert_allclose(ours.power, exact.power, rtol=1e-11)
    np.testing.assert_allclose(ours.environment, exact.environment, rtol=1e-12)
    np.testing.assert_allclose(ours.port_heat.sum(axis=1), exact.port_heat.sum(axis=1), rtol=1e-11)


def test_mean_currents_would_lose_most_of_the_heat():
    samples = rough()
    means = compress_loads(samples, 10.0)
    naive = dict(means.columns)
    for name, unit in UNITS.items():
        if unit == "A":
            naive[name] = samples.columns[name].reshape(-1, 200).mean(axis=1)
    motors = [j for j, s in enumerate(LOAD.sources) if not s.contact]
    lost = evaluate(LOAD, means.time, naive, 60.0, 10).power[:, motors].sum()
    kept = evaluate(LOAD, means.time, means.columns, 60.0, 10).power[:, motors].sum()
    assert lost < 0.4 * kept
