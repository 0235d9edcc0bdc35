"""What a plan promises is what the full model shows: the experiment finds twice the limit, and not a quarter of it.

Nothing is hidden where the plan is made. The runs of today and the proposed one are then stepped by the full model of a
machine with heat hidden in it, and judged by a detector of their own, from its discrepancy to its thresholds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from tests.hidden import small
from twin.build.simulate import Noise, simulate_run
from twin.calibrate.fit.measured import measured
from twin.diagnose.evidence.batch import score
from twin.diagnose.evidence.sight import sight
from twin.diagnose.evidence.whiten import measured_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.study import make_study, with_measured
from twin.diagnose.plan.actuators import actuators_of
from twin.diagnose.plan.experiments import experiments_of
from twin.diagnose.plan.plan import make_plan
from twin.diagnose.plan.suspicion import named
from twin.diagnose.result.plan import Foresight
from twin.diagnose.search.detector import Detector, instruments_of, make_detector
from twin.diagnose.search.policy import POLICY
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.machine.effects.edits import extended_description
from twin.machine.effects.effect import Effect
from twin.machine.load import load_machine
from twin.machine.parameters import parameters

BALL_SCREW = Path(__file__).parents[2] / "models" / "ball_screw_axis"
NOISE, TCP_NOISE, EVERY = 0.1, 1e-6, 1800.0  # K, m, s
COUNTS = (24, 40)  # synthetic measurements: thresholds are rough, sizes differ by eight


@dataclass(frozen=True)
class Case:
    """A machine, a run of it, and heat at a place that follows a signal."""

    path: Path
    text: str
    loads: Run
    place: str
    history: str  # the one whose limit is the median: that is what a limit is
    hours: float

    def simulated(self, text: str, run: Run, seed: int, name: str) -> Run:
        made, _ = simulate_run(
            load_machine(self.path, text), run, 60.0, 1, self.hours, EVERY, noise=Noise(NOISE, TCP_NOISE, seed)
        )
        return replace(made, folder=Path(name))

    def next_detector(self, text: str, new: Run) -> Detector:
        """Of today's run and a new one, in which nothing is hidden."""
        runs = [self.simulated(self.text, self.loads, 1, "today"), self.simulated(text, new, 2, "next")]
        return detector_of(self.path, text, runs)

    def hidden(self, text: str, detector: Detector, size: float) -> str:
        """A description with heat of `size` [W] at the largest value that the signal has today."""
        signal, exponent, reference = detector.elements.histories.unit[self.history]
        effect = Effect(
            "heat_source", self.place, size, "W", self.history, signal, exponent, (), {"reference": reference}
        )
        return extended_description(text, [effect]).text


def detector_of(path: Path, text: str, runs: list[Run]) -> Detector:
    machine = load_machine(path, text)
    probed = make_probed_model(machine, parameters(machine), runs)
    plans = [measured(probed.base, run, own.drive, own.name) for run, own in zip(runs, probed.runs, strict=True)]
    study = make_study(probed, plans, range(len(runs)))
    return make_detector(study, FAMILIES, instruments_of(study, NOISE, TCP_NOISE), POLICY, counts=COUNTS)


def statistic(detector: Detector, runs: list[Run], place: str, history: str) -> float:
    """Of heat at a place with a history, in these runs."""
    study = detector.study
    plans = [
        measured(study.probed.base, run, planned.run.drive, planned.run.name)
        for run, planned in zip(runs, study.runs, strict=True)
    ]
    fitter = replace(detector.fitter, study=with_measured(study, plans))
    fitted = fitter(measured_of(fitter.study))
    seen = sight(detector.columns, fitted.projector, fitter.whiten(fitted.residual))
    own = next(o for o in seen.ready if o.batch.family == "heat_source")
    names = [h.name for h in own.batch.histories]
    return float(score(own, seen.g).statistic[own.batch.places.index(place), names.index(history)])


def without(run: Run, sensor: str) -> Run:
    assert run.temperatures is not None
    columns = {name: v for name, v in run.temperatures.columns.items() if name != sensor}
    return replace(run, temperatures=replace(run.temperatures, columns=columns))


def planned(case: Case) -> tuple[Detector, Run, Foresight]:
    today = case.simulated(case.text, case.loads, 1, "today")
    detector = detector_of(case.path, case.text, [today])
    (suspicion,) = named(f"heat_source {case.place}", detector)
    plan = make_plan(detector, load_machine(case.path, case.text), [today], [suspicion], [], NOISE)
    return detector, today, plan.suspicions[0]


def judged(
    case: Case, detectors: tuple[Detector, Detector], size: float, text: str, new: Run, sensor: str = ""
) -> tuple[float, float]:
    """Statistics over thresholds of heat of a size [W]: in today's run alone, and with the proposed one."""
    now, then = detectors
    hidden = case.hidden(text, now, size)
    runs = [without(case.simulated(hidden, case.loads, 3, "today"), sensor), case.simulated(hidden, new, 4, "next")]
    alone = statistic(now, runs[:1], case.place, case.history) / now.thresholds["heat_source"]
    both = statistic(then, runs, case.place, case.history) / then.thresholds["heat_source"]
    print(f"{size:.3g} W: {alone:.2f} of the threshold today, {both:.2f} with the experiment")
    return alone, both


@pytest.mark.trials
def test_a_sensor_at_the_far_bearing_of_a_ball_screw_finds_what_it_promises():
    text = (BALL_SCREW / "nodes.toml").read_text("utf-8")
    loads = read_run(BALL_SCREW / "runs" / "mixed_load")
    case = Case(BALL_SCREW / "nodes.toml", text, loads, "far_block", "x_speed", 6.0)
    now, _, foresight = planned(case)
    best = foresight.proposals[0]
    assert best.experiment == "sensor at far_block"
    assert best.gain > 2.0
    assert best.gain > 1.5 * foresight.today / foresight.again
    with_sensor = f'{text}\n[sensors.far]\npart = "far_block"\n'
    assert 2.0 * best.limit < foresight.today
    detectors = now, case.next_detector(with_sensor, loads)
    alone, both = judged(case, detectors, 2.0 * best.limit, with_sensor, loads, "far")
    assert alone < 1.0 < both
    _, both = judged(case, detectors, 0.25 * best.limit, with_sensor, loads, "far")
    assert both < 1.0


@pytest.mark.trials
def test_an_axis_to_and_fro_on_a_meshed_machine_finds_what_it_promises(tmp_path):
    loads = read_run(small.loads(tmp_path / "loads", 0))
    case = Case(small.SLIDE, small.described(), loads, "foot_1.x_max", "x_speed", float(small.HOURS))
    now, today, foresight = planned(case)
    best = next(p for p in foresight.proposals if p.experiment == "x to and fro")
    assert best.gain > foresight.today / foresight.again
    load = now.study.probed.base.load_model
    actuators = actuators_of(load, [now.study.runs[0].run.signals])
    made = experiments_of(load, today, now.study.runs[0].measured.sensors, actuators, [])
    print(f"to and fro: {foresight.today:.3g} W today, {best.limit:.3g} W then")
    new = replace(next(e.run for e in made if e.name == best.experiment), temperatures=None)
    detectors = now, case.next_detector(case.text, new)
    _, both = judged(case, detectors, 2.0 * best.limit, case.text, new)
    assert both > 1.0
    _, both = judged(case, detectors, 0.25 * best.limit, case.text, new)
    assert both < 1.0
