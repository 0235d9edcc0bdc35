"""An environment's offset shifts what the machine feels, exactly as warmer air would, and not what a sensor shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.lumped import edited
from twin.build.lumped import assemble_lumped, lumped_bodies
from twin.machine.load import load_machine
from twin.rom.drive import evaluate, measured_air
from twin.rom.load_model import LoadModel

NATURAL = (  # free convection, which follows the temperature of the air; the other films do not
    '[films.air]\nlaw = "constant_film"\nsurfaces = ["housing", "shaft", "bed"]\nenvironment = "shop"\n'
    'parameters = { natural = "6 W/(m^2*K)" }',
    '[films.air]\nlaw = "free_vertical_plate"\nsurfaces = ["housing", "shaft", "bed"]\nenvironment = "shop"\n'
    'parameters = { height = "0.5 m" }',
)


def load_model(folder, *edits) -> LoadModel:
    machine = load_machine(edited(folder, *edits))
    return assemble_lumped(machine, lumped_bodies(machine)).load_model


def loads(load: LoadModel, **warmer):
    """Two hours of drifting loads; signals named get warmer by so many K."""
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 7200.0, 10.0)
    signals = {s.name: s.low + (s.high - s.low) * rng.random(len(time)) for s in load.signals}
    return time, {name: values + warmer.get(name, 0.0) for name, values in signals.items()}


@pytest.mark.parametrize(
    ("environment", "signal", "offset"), [("shop", "shop_air", 1.5), ("coolant", "coolant_inlet", -0.7)]
)
def test_an_offset_is_warmer_air(tmp_path, environment, signal, offset):
    plain = load_model(tmp_path, NATURAL)
    moved = load_model(tmp_path, NATURAL, (f'signal = "{signal}"', f'signal = "{signal}"\noffset = "{offset} K"'))
    assert {e.name: e.offset for e in moved.environments} == {"shop": 0.0, "coolant": 0.0} | {environment: offset}
    here = evaluate(moved, *loads(moved), 60.0)
    there = evaluate(plain, *loads(plain, **{signal: offset}), 60.0)
    np.testing.assert_allclose(here.environment, there.environment, atol=1e-12)
    np.testing.assert_allclose(here.films.value, there.films.value, rtol=1e-12)
    np.testing.assert_allclose(here.theta, there.theta, rtol=1e-12)
    unmoved = evaluate(plain, *loads(plain), 60.0)
    np.testing.assert_allclose(measured_air(moved, here), unmoved.environment, atol=1e-12)
    assert not np.allclose(here.environment, unmoved.environment)


def test_a_constant_temperature_takes_an_offset(tmp_path):
    constant = ('signal = "shop_air"', 'temperature = "21 degC"\noffset = "-400 mK"')
    load = load_model(tmp_path, constant)
    drive = evaluate(load, *loads(load), 60.0)
    assert drive.environment[:, 0] == pytest.approx(20.6)
    assert measured_air(load, drive)[:, 0] == pytest.approx(21.0)


def test_certified_films_are_those_of_the_air_that_is_felt(tmp_path):
    """The least and greatest coefficient of free convection belong to the air's own range."""
    moved = load_model(tmp_path, NATURAL, ('signal = "shop_air"', 'signal = "shop_air"\noffset = "3 K"'))
    wider = load_model(tmp_path, NATURAL, ("range = [12.0, 32.0]", "range = [15.0, 35.0]"))
    here, there = (next(f for f in load.films if f.name == "air") for load in (moved, wider))
    assert (here.low, here.high) == pytest.approx((there.low, there.high), rel=1e-12)
    plain = next(f for f in load_model(tmp_path, NATURAL).films if f.name == "air")
    assert here.high != pytest.approx(plain.high, rel=1e-6)


def test_artefacts_from_before_there_were_offsets_are_read(tmp_path):
    load = load_model(tmp_path)
    old = load.to_json()
    for environment in old["environments"]:
        del environment["offset"]
    assert LoadModel.from_json(old) == load
    moved = replace(load, environments=tuple(replace(e, offset=1.0) for e in load.environments))
    assert LoadModel.from_json(moved.to_json()) == moved
