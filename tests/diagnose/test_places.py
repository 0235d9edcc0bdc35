"""Places where something may act: they leave the model what it was, and give a watt or a film where one is wanted."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from tests.support.descriptions import SLIDE
from twin.build.acting import Acting, with_acting
from twin.build.full_model import assemble
from twin.build.mesh import load_body_meshes
from twin.build.places import DISPLACED, PREFIX, places_of, pruned, with_displaced_sensors, with_places
from twin.build.probe import near
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.inject.machines.drawn import draw_machine
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.rom.drive import evaluate

STEPS = 12


@pytest.fixture(scope="module", params=["meshed", "lumped"])
def placed(request):
    """A machine's full model, its places, and the model with them."""
    machine = load_machine(SLIDE) if request.param == "meshed" else small_case.machine()
    full = assemble(machine)
    places = places_of(machine, full)
    if request.param == "meshed":
        run = read_run(SLIDE.parent / "runs" / "short")
    else:
        run = small_case.runs()[0]
    load = full.thermal.load_model
    drive = evaluate(load, run.loads.time, signal_values(run, load.signals), 60.0, STEPS)
    return machine, full, places, with_places(full, places), drive


def stepped(model, drive):
    stepper = CoupledStepper(model)
    states = [x for _, x, _ in stepper.run(drive, stepper.uniform(21.0))]
    return states[-1]


def test_nothing_acts_unless_it_is_told_to(placed):
    _, full, _, model, drive = placed
    wanted = stepped(full.thermal, drive)
    got = stepped(model, with_acting(drive, model.load_model, Acting()))
    for a, b in zip(got, wanted, strict=True):
        assert np.ptp(b) > 0.01
        np.testing.assert_allclose(a, b, atol=1e-9 * np.abs(b).max())


def test_pruned_of_all_places_it_is_the_model(placed):
    _, full, _, model, drive = placed
    plain = pruned(model)
    assert plain.load_model == full.thermal.load_model
    for a, b in zip(plain.bodies, full.thermal.bodies, strict=True):
        np.testing.assert_array_equal(a.B, b.B)
        np.testing.assert_array_equal(a.M, b.M)
        assert (a.theta, a.sources) == (b.theta, b.sources)
    for a, b in zip(stepped(plain, drive), stepped(full.thermal, drive), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-13)  # other shapes of memory, other roundings


def test_pruned_keeps_what_is_wanted(placed):
    _, full, places, model, drive = placed
    chosen = places[len(places) // 2]
    small = pruned(model, [chosen.name], [chosen.name])
    names = [s.name for s in small.load_model.sources if s.name.startswith(PREFIX)]
    assert names == [PREFIX + chosen.name]
    acting = Acting({chosen.name: np.full(STEPS, 50.0)}, {chosen.name: np.full(STEPS, 8.0)},
                    {chosen.name: np.full(STEPS, 30.0)})  # fmt: skip
    got = stepped(small, with_acting(drive, small.load_model, acting))
    wanted = stepped(model, with_acting(drive, model.load_model, acting))
    moved = 0.0
    for a, b, still in zip(got, wanted, stepped(full.thermal, drive), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9 * np.abs(b).max())
        moved = max(moved, float(np.abs(b - still).max()))
    assert moved > 0.1
    with pytest.raises(KeyError):
        with_acting(drive, small.load_model, Acting({"nowhere": np.ones(STEPS)}))


def test_a_watt_is_a_watt_and_a_film_has_its_area(placed):
    machine, full, places, model, _ = placed
    n_sources = len(full.thermal.load_model.sources)
    n_films = len(full.thermal.load_model.films)
    seen = set()
    for mesh_body, body in zip(full.thermal.bodies, model.bodies, strict=True):
        for column, source in enumerate(body.sources):
            if source >= n_sources:
                place = places[source - n_sources]
                mine = [p for p in place.members if p in mesh_body.members]
                assert mine
                assert body.B[:, column] @ body.one == pytest.approx(1.0)
                seen.add(place.name)
        for term, k in zip(body.A, body.theta, strict=True):
            if n_films <= k < n_films + len(places):
                area = float(body.one @ (term @ body.one))
                whole = places[k - n_films].area
                assert 0.0 < area <= whole * (1.0 + 1e-9)
                if not machine.lumped and len(places[k - n_films].members) == 1:
                    assert area == pytest.approx(whole)
    assert seen == {p.name for p in places}
    assert len(seen) == len(places)


def test_heat_at_a_place_warms_what_is_there():
    """40 W for twelve minutes into the plate: its sensor first, the bed last."""
    machine = load_machine(SLIDE)
    full = assemble(machine)
    places = places_of(machine, full)
    assert {"plate.z_max", "contacts.x_guide", "bed.y_min"} <= {p.name for p in places}
    model = with_places(full, places)
    run = read_run(SLIDE.parent / "runs" / "short")
    load = full.thermal.load_model
    drive = evaluate(load, run.loads.time, signal_values(run, load.signals), 60.0, STEPS)
    power = Acting({"plate.z_max": np.full(STEPS, 40.0)})
    warm = stepped(model, with_acting(drive, model.load_model, power))
    change = sensor_temperatures(model, warm) - sensor_temperatures(full.thermal, stepped(full.thermal, drive))
    by = dict(zip(full.thermal.sensors, change, strict=True))
    assert by["plate"] > 1.0
    assert by["plate"] > 1.5 * by["slide"] > 0.0
    assert abs(by["bed_front"]) < 0.03


def test_displaced_sensors_stand_beside_their_sensors():
    machine = load_machine(SLIDE)
    displaced = with_displaced_sensors(machine, load_body_meshes(machine))
    own = [s for s in displaced.sensors if s.endswith(DISPLACED)]
    assert len(own) == sum(s.part is not None for s in machine.sensors.values())
    for name in own:
        a, b = displaced.sensors[name], machine.sensors[name.removesuffix(DISPLACED)]
        assert np.linalg.norm(np.subtract(a.position, b.position)) == pytest.approx(0.008)
    assert with_displaced_sensors(small_case.machine(), ()) is small_case.machine()


def test_sensors_of_small_parts_are_displaced_the_other_way_or_less(tmp_path):
    """8 mm off a bearing block of 100 mm is off the block, and no diagnosis of that machine was made."""
    drawn = draw_machine(0, "boxes")
    drawn.write(tmp_path / "m")
    machine = drawn.machine(tmp_path / "m")
    bodies = load_body_meshes(machine)
    displaced = with_displaced_sensors(machine, bodies)
    parts = {part.name: part for body in bodies for part in body.parts}
    far = []
    for name in (s for s in displaced.sensors if s.endswith(DISPLACED)):
        a, b = displaced.sensors[name], machine.sensors[name.removesuffix(DISPLACED)]
        assert near(parts[b.part], np.array(a.position))
        far.append(float(np.linalg.norm(np.subtract(a.position, b.position))))
    assert len(far) == sum(s.part is not None for s in machine.sensors.values())
    assert min(far) > 0.0015
