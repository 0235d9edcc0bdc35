"""What `twin diagnose` says of the trials: the nominal machine and the runs, nothing else."""

from __future__ import annotations

import fcntl
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from tests.hidden.trials import MODEL, STATES, trial
from twin.build.cache import folder
from twin.build.project import orthonormalise, project
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.coarse_model import Coarse, too_coarse
from twin.diagnose.pipeline import Settings, prepare
from twin.diagnose.result.diagnosis import Cause, Verdict
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.excused import other_search
from twin.diagnose.search.verdict import unknown_of, verdict_of, with_faults
from twin.machine.load import load_machine
from twin.rom.model import MachineModel

SETTINGS = Settings(temperature_sigma=0.08)  # as the campaign: they share a detector
QUICK = replace(SETTINGS, form=16, nulls=40)  # thresholds from few synthetic measurements: most are the floor anyway

OWN = ("signal_peak", "clock", "sensor_stuck")  # other logs, other gaps: they need a detector of their own


@dataclass(frozen=True)
class Said:
    """Of one trial."""

    verdict: Verdict
    causes: tuple[Cause, ...]
    part: str  # that unknown heat enters, "" if none
    coarse: Coarse | None = None  # of the artefact


@cache
def made_detector(settings: Settings = SETTINGS) -> Detector:
    """Of the nominal machine on the loads of the trials; minutes on two cores, then in the cache folder."""
    machine = load_machine(MODEL)
    runs = trial("null_0").runs
    folder().mkdir(parents=True, exist_ok=True)
    with (folder() / "detector.lock").open("w") as lock:  # one process makes it, the others wait
        fcntl.flock(lock, fcntl.LOCK_EX)
        return prepare(machine, runs[:2], runs[2:], settings)[0]


def said(settings: Settings, name: str) -> Said:
    """The diagnosis of a trial."""
    runs = trial(name).runs
    if name in OWN:
        detector = prepare(load_machine(MODEL), runs[:2], runs[2:], settings)[0]
    else:
        detector = made_detector(settings)
    study = detector.study
    found, _, own = other_search(detector, runs)
    verdict, causes = with_faults(*verdict_of(found, FAMILIES), own.faults)
    states, coarse = STATES.get(name), None
    if states:
        coarse = too_coarse(_few(detector, states), study, settings.temperature_sigma, settings.tcp_sigma)
    unknown = unknown_of(found)
    return Said(verdict, causes, "" if unknown is None else unknown.part, coarse)


def _few(detector: Detector, states: int) -> MachineModel:
    """A model of few states: the leading directions of what the described machine does in the runs."""
    study = detector.study
    (body,) = study.probed.base.bodies
    shown = np.vstack([study.states(k, np.zeros(len(study.probed.parameters))) for k in study.fitted])
    V = np.linalg.svd(shown, full_matrices=False)[2][: states - 1].T
    small = project(body, orthonormalise(np.column_stack([body.one, V]), body.E))
    return replace(study.probed.base, bodies=(small,))
