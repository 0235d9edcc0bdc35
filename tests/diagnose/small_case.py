"""The lumped machine of the tests in two runs of 4 h and a sealed one, ready for a diagnosis. Nothing is hidden."""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from tests.calibrate import lumped_case
from twin.calibrate.fit.measured import measured
from twin.diagnose.evidence.film_laws import with_film_laws
from twin.diagnose.evidence.nulls import Form
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.elements import Elements, elements_of
from twin.diagnose.model.bank import Nominal, nominal_run, respond
from twin.diagnose.model.probed_model import ProbedModel, make_probed_model
from twin.diagnose.model.study import Study, make_study
from twin.diagnose.search.detector import Detector, instruments_of, make_detector
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.start import afresh
from twin.logs.read import read_run
from twin.logs.run import Run, Table, Tcp
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.machine.parameters import parameters

HOURS = 4.0
NOISE, TCP_NOISE = 0.05, 0.3e-6


BEARING = 'law = "bearing_friction"'
TURNING = 'law = "turning_heat"\nparameters = { power = "60 W", reference = "100 1/s", exponent = 1.5 }\n'


@cache
def machine(linear: bool = False) -> Machine:
    """As shipped, or with laws that read no temperature: no radiation, bearings that heat with the speed alone."""
    if not linear:
        return load_machine(lumped_case.FOLDER)
    lines = (lumped_case.FOLDER / "machine.toml").read_text("utf-8").splitlines()
    kept, bearing = [], False
    for line in lines:
        bearing = (bearing or line == BEARING) and bool(line)
        if line == BEARING:
            kept.append(TURNING)
        elif not (bearing and line.startswith("parameters")):
            kept.append(line)
    text = "\n".join(kept).replace(
        'environment = "shop"\nparameters', 'environment = "shop"\nemissivity = 0.0\nparameters'
    )
    return load_machine(lumped_case.FOLDER / "machine.toml", text)


@cache
def runs() -> tuple[Run, ...]:
    """Loads that switch on and off, and times at which something is measured; all readings are 20 degC."""
    shipped = read_run(next(f for f in (lumped_case.FOLDER / "runs").iterdir() if f.is_dir()))
    made = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        time = np.arange(0.0, HOURS * 3600.0 + 1.0, 60.0)
        n = len(time)

        def switched(top: float, length: int, rng: np.random.Generator = rng, n: int = n) -> np.ndarray:
            return top * np.repeat(rng.random(n // length + 1), length)[:n]

        speed = switched(90.0, 37) * (switched(1.0, 51) > 0.3)
        columns = {
            "x_position": 0.1 + 0.15 * np.sin(time / 300.0),
            "x_speed": switched(0.3, 45),
            "spindle_current": switched(16.0, 29) * (speed > 0.0),
            "spindle_speed": speed,
            "shop_air": 20.0 + 1.5 * np.sin(time / 5000.0 + seed),
            "coolant_inlet": 19.0 + 0.5 * np.sin(time / 3000.0),
        }
        assert set(columns) == set(shipped.loads.columns)
        units = {"x_position": "m", "x_speed": "m/s", "spindle_speed": "1/s"}
        loads = Table(time, columns, {**shipped.loads.units, **units})
        still = {s: np.full(n, 20.0) for s in ("front", "housing", "screw_middle")}
        rows = np.arange(900.0, time[-1], 900.0)
        tcp = Tcp(rows, ("x",), rng.uniform(-0.1, 0.3, (len(rows), 1)), np.zeros((len(rows), 3)),
                  np.full(len(rows), TCP_NOISE))  # fmt: skip
        made.append(
            replace(
                shipped,
                loads=loads,
                temperatures=Table(time, still, dict.fromkeys(still, "degC")),
                tcp=tcp,
                initial_temperature=20.0,
                folder=Path(f"run_{seed}"),
            )
        )
    return tuple(made)


@cache
def probed(linear: bool = False) -> ProbedModel:
    return make_probed_model(machine(linear), parameters(machine(linear)), runs())


@cache
def described(linear: bool = False) -> Study:
    """With the numbers of the description alone."""
    own = probed(linear)
    plans = [measured(own.base, run, b.drive, b.name) for run, b in zip(runs(), own.runs, strict=True)]
    return make_study(own, plans, range(2))


def form(linear: bool = False) -> Form:
    """Contacts are more uncertain than those of other machines, and how films react to their own rise is known: how
    causes are fitted is tested here, and beside ten more numbers few sensors tell less of them."""
    return Form(exponents=(0.0, 0.0), contact=0.5)


@cache
def study(linear: bool = False) -> Study:
    return with_film_laws(described(linear), form(linear))


@cache
def nominal(linear: bool = False) -> tuple[Nominal, ...]:
    return tuple(nominal_run(study(linear), k) for k in range(3))


@cache
def elements(linear: bool = False) -> Elements:
    return elements_of(study(linear), nominal(linear))


@cache
def responses(linear: bool = False) -> np.ndarray:
    """(m, n_columns) of all elementary causes."""
    return respond(study(linear), nominal(linear), elements(linear).vectors, elements(linear).columns)


def made_detector() -> Detector:
    """From few synthetic measurements: thresholds are rough; no test knows what another one has derived."""
    return afresh(_detector())


@cache
def _detector() -> Detector:
    instruments = instruments_of(study(), NOISE, TCP_NOISE)
    return make_detector(study(), FAMILIES, instruments, POLICY, form(), counts=(24, 40))


def source_off(pull: float) -> tuple[int, np.ndarray]:
    """The first source's place among the parameters, and outputs (m,) without noise with it so many prior standard
    deviations from its described value."""
    own = study()
    x = np.zeros(len(own.probed.parameters))
    j = next(i for i, p in enumerate(own.probed.parameters) if p.kind == "source")
    x[j] = pull
    return j, np.concatenate([own.outputs(k, x) for k in own.fitted])
