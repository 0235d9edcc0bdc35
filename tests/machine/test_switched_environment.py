"""A switched offset is warmer air while the switch is on, and no sensor shows it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.machine.test_offset import NATURAL, load_model
from twin.errors import DescriptionError
from twin.rom.drive import evaluate, measured_air

DOOR = '\n[signals.door]\nunit = "1"\nrange = [0.0, 1.0]\n'
AIR = '[environment.shop]\nsignal = "shop_air"'
SWITCHED = (AIR, f'{DOOR}{AIR}\noffset = "0.5 K"\nswitch = "door"\nswitched_offset = "-3 K"')
TIME = np.arange(0.0, 7200.0, 10.0)
OPEN = np.where(TIME % 1800.0 < 905.0, 1.0, 0.0)  # half a step at a time, once in a while


def signals(load, **changes):
    rng = np.random.default_rng(4)
    values = {s.name: s.low + (s.high - s.low) * rng.random(len(TIME)) for s in load.signals if s.name != "door"}
    return values | changes


def test_it_is_colder_air_while_the_door_is_open(tmp_path):
    plain, moved = load_model(tmp_path, NATURAL), load_model(tmp_path, NATURAL, SWITCHED)
    air = signals(plain)["shop_air"]
    here = evaluate(moved, TIME, signals(moved, door=OPEN), 60.0)
    there = evaluate(plain, TIME, signals(plain, shop_air=air + 0.5 - 3.0 * OPEN), 60.0)
    np.testing.assert_allclose(here.environment, there.environment, atol=1e-12)
    np.testing.assert_allclose(here.films.value, there.films.value, rtol=1e-12)  # laws see the same air
    unmoved = evaluate(plain, TIME, signals(plain), 60.0)
    np.testing.assert_allclose(measured_air(moved, here), unmoved.environment, atol=1e-12)
    assert np.ptp(here.environment[:, 0] - unmoved.environment[:, 0]) == pytest.approx(3.0)


def test_of_a_constant_temperature(tmp_path):
    constant = ('signal = "shop_air"', 'temperature = "21 degC"\nswitch = "door"\nswitched_offset = "2 K"')
    load = load_model(tmp_path, constant, ("[environment.shop]", f"{DOOR}[environment.shop]"))
    drive = evaluate(load, TIME, signals(load, door=OPEN), 1800.0)
    assert drive.environment[:, 0] == pytest.approx(21.0 + 2.0 * 91 / 180)  # the share of time on
    assert measured_air(load, drive)[:, 0] == pytest.approx(21.0)


def test_the_certified_film_covers_both(tmp_path):
    def film(*edits):
        load = load_model(tmp_path, NATURAL, *edits)
        return next(f for f in load.films if f.name == "air")

    switched = (AIR, f'{DOOR}{AIR}\nswitch = "door"\nswitched_offset = "-10 K"')
    here, there = film(switched), film(("range = [12.0, 32.0]", "range = [2.0, 32.0]"))
    assert here.low == pytest.approx(there.low, rel=0.02)
    assert here.high == pytest.approx(there.high, rel=0.02)
    assert here.low < 0.95 * film().low


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('switch = "door"', "belong together"),
        ('switched_offset = "1 K"', "belong together"),
        ('switch = "dor"\nswitched_offset = "1 K"', "unknown signal 'dor'"),
        ('switch = "x_speed"\nswitched_offset = "1 K"', "expected a unit of 1"),
        ('switch = "wide"\nswitched_offset = "1 K"', "outside 0 .. 1"),
    ],
)
def test_half_a_switch_is_refused(tmp_path, more, said):
    wide = DOOR.replace("door", "wide").replace("1.0]", "2.0]")
    with pytest.raises(DescriptionError) as e:
        load_model(tmp_path, (AIR, f"{DOOR}{wide}{AIR}\n{more}"))
    assert any(said in p.what and "environment.shop.switch" in p.where for p in e.value.problems)
