"""Faults of several families hidden in a small FE machine, and none: each must be said as what it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hidden import small
from twin.calibrate.fit.measured import measured
from twin.diagnose.evidence.whiten import measured_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.model.study import with_measured
from twin.diagnose.pipeline import Settings, prepare
from twin.diagnose.result.diagnosis import Cause, Verdict
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.dispersion import searched
from twin.diagnose.search.verdict import verdict_of
from twin.logs.read import read_run
from twin.machine.load import load_machine

pytestmark = pytest.mark.long

SETTINGS = Settings(temperature_sigma=0.05, tcp_sigma=0.5e-6, form=12, nulls=24)
IN_MACHINE = {
    "heat_source": ("bed.y_max", "15 W"),
    "joint": ("contacts.screw_end", "0.02"),
    "expansion": ("parts.screw", "1.6"),
}
IN_LOG = {
    "drift": ("sensor", "sensors.screw", "1 K", "--history", "drift"),
    "swapped": ("sensor", "sensors.rail", "sensors.slide_end", "--history", "swapped"),
    "measurement": ("measurement", "tcp.dz", "6 um"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("small")
    small.folder_of(small.described(), out / "described")
    small.folder_of(small.other(1), out / "real")
    return out


@pytest.fixture(scope="module")
def healthy(folder: Path) -> list[Path]:
    """Runs of a machine without a fault."""
    (folder / "healthy").mkdir()
    return small.simulated(folder / "real", folder / "healthy")


@pytest.fixture(scope="module")
def detector(folder: Path, healthy: list[Path]) -> Detector:
    runs = [read_run(path) for path in healthy]
    return prepare(load_machine(folder / "described"), runs, (), SETTINGS)[0]


def said(detector: Detector, runs: list[Path]) -> tuple[Verdict, tuple[Cause, ...]]:
    study = detector.study
    plans = [
        measured(study.probed.base, read_run(path), p.run.drive, p.run.name)
        for path, p in zip(runs, study.runs, strict=True)
    ]
    return verdict_of(searched(detector, measured_of(with_measured(study, plans)))[0], FAMILIES)


def in_machine(folder: Path, family: str) -> list[Path]:
    place, size = IN_MACHINE[family]
    small.twin("hide", family, place, size, folder / "real", "-o", folder / f"with_{family}")
    (folder / family).mkdir()
    return small.simulated(folder / f"with_{family}", folder / family)


def in_log(folder: Path, healthy: list[Path], name: str) -> list[Path]:
    family, place, size, *more = IN_LOG[name]
    made = [folder / f"{name}_{k}" for k in range(len(healthy))]
    for run, damaged in zip(healthy, made, strict=True):
        small.twin("hide", family, place, size, run, "-o", damaged, *more)
    return made


def test_nothing_is_said_of_a_healthy_machine(detector, healthy):
    assert said(detector, healthy) == ("nothing", ())


def test_a_heat_source_is_named_at_its_place_with_its_size(folder, detector):
    verdict, (cause,) = said(detector, in_machine(folder, "heat_source"))
    assert (verdict, cause.family, cause.place, cause.history) == ("named", "heat_source", "bed.y_max", "always")
    low, high = cause.ci95
    assert low < 15.0 < high
    assert high - low < 7.5


@pytest.mark.slow
def test_a_joint_that_lost_its_preload_is_said_to_be_out_of_tolerance(folder, detector):
    """Its conductance is a declared parameter: a fiftieth of it is no missing effect, but a number that is wrong."""
    verdict, (cause,) = said(detector, in_machine(folder, "joint"))
    assert (verdict, cause.family, cause.place) == ("out_of_tolerance", "joint", "contacts.screw_end")
    assert cause.ci95[0] <= 0.02 <= cause.ci95[1] < 0.5


@pytest.mark.slow
def test_a_screw_that_expands_too_much_is_named_with_its_factor(folder, detector):
    verdict, (cause,) = said(detector, in_machine(folder, "expansion"))
    assert (verdict, cause.family, cause.place) == ("named", "expansion", "parts.screw")
    assert cause.ci95[0] < 1.6 < cause.ci95[1]


def test_a_drifting_sensor_is_blamed_and_the_machine_is_not(folder, detector, healthy):
    verdict, causes = said(detector, in_log(folder, healthy, "drift"))
    assert (verdict, [(c.family, c.place, c.history) for c in causes]) == (
        "sensor",
        [("sensor", "sensors.screw", "drift")],
    )


def test_swapped_sensors_are_both_named(folder, detector, healthy):
    verdict, (cause,) = said(detector, in_log(folder, healthy, "swapped"))
    assert (verdict, cause.family, cause.history) == ("sensor", "sensor", "swapped")
    assert cause.place == "sensors.rail<>slide_end"


def test_a_drifting_probe_is_told_from_the_machine(folder, detector, healthy):
    verdict, (cause,) = said(detector, in_log(folder, healthy, "measurement"))
    assert (verdict, cause.family, cause.place, cause.history) == ("named", "measurement", "tcp.dz", "drift")
    assert cause.ci95[0] < 6e-6 / (3600.0 * small.HOURS) < cause.ci95[1]
