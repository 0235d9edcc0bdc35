"""Friction that falls with the temperature of its lubricant, where the description takes one viscosity for all."""

from __future__ import annotations

import numpy as np
import pytest

from tests.calibrate import lumped_case
from tests.diagnose import small_case
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.table import family_of
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.study import make_study
from twin.diagnose.search.forward import search
from twin.diagnose.search.verdict import verdict_of
from twin.errors import DescriptionError
from twin.machine.load import load_machine
from twin.physics.bearings import oil_viscosity

pytestmark = pytest.mark.long

SOURCE = "sources.front"
DESCRIBED = 'law = "bearing_friction"\nsurface = "bearing_front"\nparameters = { f0 = 2.0, viscosity = "20 mm^2/s",'
REAL = 'law = "bearing_friction_warm"\nsurface = "bearing_front"\nparameters = { f0 = 2.0, viscosity_40 = "20 mm^2/s", '
OIL = 20e-6, 4e-6  # m^2/s at 40 and 100 degC


def text(law: str) -> str:
    """The description with a law of the front bearing."""
    described = (lumped_case.FOLDER / "machine.toml").read_text("utf-8")
    assert DESCRIBED in described
    return described.replace(DESCRIBED, law)


def measured(seed: int) -> np.ndarray:
    """(m,) of the machine with the oil that it really has."""
    study = small_case.study()
    real = load_machine(lumped_case.FOLDER, text(REAL + 'viscosity_100 = "4 mm^2/s",'))
    probed = make_probed_model(real, study.probed.parameters, small_case.runs())
    plans = [planned.measured for planned in study.runs]
    y = make_study(probed, plans, study.fitted).all_outputs(np.zeros(len(study.probed.parameters)))
    rng = np.random.default_rng(seed)
    return y + small_case.made_detector().whiten.colour(rng.standard_normal(len(y)))


def test_friction_that_falls_with_its_own_temperature_is_named_at_its_source():
    detector = small_case.made_detector()
    found = search(detector, measured(1))
    verdict, causes = verdict_of(found, FAMILIES)
    first = causes[0]
    assert verdict in ("named", "ambiguous")
    assert (first.family, first.place, first.unit) == ("loss_law", SOURCE, "1/K")
    # the viscous part goes with the viscosity to the power of 2/3, and is most of it at these speeds
    falls = (2.0 / 3.0) * np.log(oil_viscosity(45.0, *OIL) / oil_viscosity(35.0, *OIL)) / 10.0
    assert 1.5 * falls < first.amplitude < 0.3 * falls
    with pytest.raises(DescriptionError, match="no law takes"):  # it is named, and not written
        family_of(first.family).edit(first, detector.study)


def test_the_same_machine_with_the_oil_that_is_described_has_none():
    detector = small_case.made_detector()
    study, rng = detector.study, np.random.default_rng(2)
    y = study.all_outputs(np.zeros(len(study.probed.parameters)))
    found = search(detector, y + detector.whiten.colour(rng.standard_normal(len(y))))
    assert verdict_of(found, FAMILIES)[0] == "nothing"
