"""Moving contacts: segments, stations, pads, and the patch test at any position."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin.build.mesh import load_body_meshes
from twin.build.ports import contact_ports, find_part, port_averages
from twin.errors import DescriptionError
from twin.machine.description import Contact, Machine
from twin.machine.load import load_machine
from twin.rom.contact import station_weights

SLIDE = load_machine(Path(__file__).parents[1] / "machines" / "slide")
BODIES = load_body_meshes(SLIDE)
PORTS = contact_ports(SLIDE, BODIES)


def changed(name: str, **update: object) -> Machine:
    contact = SLIDE.contacts[name].model_copy(update=update)
    return SLIDE.model_copy(update={"contacts": {**SLIDE.contacts, name: contact}})


def test_pads_on_one_rail_share_its_segments():
    assert [r.name for r in PORTS.rails] == ["rail_1.z_max", "rail_2.z_max", "screw.z_max"]
    assert [p.rail for p in PORTS.pairs] == [0, 0, 1, 1, 2]
    assert PORTS.names[:3] == ("rail_1.z_max[0]", "rail_1.z_max[1]", "rail_1.z_max[2]")
    assert [PORTS.names[p.pad_port] for p in PORTS.pairs] == [
        f"{p}.z_min" for p in ("pad_1", "pad_2", "pad_3", "pad_4", "nut")
    ]
    assert len(PORTS.names) == len(PORTS.patches) == 8 + 8 + 10 + 5
    np.testing.assert_allclose(PORTS.rails[0].stations, -0.35 + 0.1 * np.arange(8), atol=1e-14)
    assert [p.area for p in PORTS.pairs] == pytest.approx([0.06 * 0.03] * 5)


def port_temperatures(slope: float, shift: float) -> np.ndarray:
    """Port averages of T = slope * x, the slide having moved by `shift`."""
    T = np.zeros(len(PORTS.names))
    for body in BODIES:
        P, numbers = port_averages(body, PORTS)
        moved = body.nodes[:, 0] + (shift if body.name == "slide" else 0.0)
        T[list(numbers)] = P.T @ (20.0 + slope * moved)
    return T


@settings(max_examples=60, deadline=None)
@given(position=st.floats(-0.2, 0.2), slope=st.floats(-100, 100))
def test_a_linear_temperature_along_the_rail_drives_no_heat_at_any_position(position: float, slope: float):
    T = port_temperatures(slope, position)
    for pair in PORTS.pairs:
        rail = PORTS.rails[pair.rail]
        stations = np.array(rail.stations)
        i, right = station_weights(stations, np.array([pair.station + position]))
        on_rail = (1 - right) * T[rail.first_port + i] + right * T[rail.first_port + i + 1]
        assert abs(on_rail[0] - T[pair.pad_port]) < 1e-10


@settings(max_examples=20, deadline=None)
@given(position=st.floats(-0.2, 0.2))
def test_rails_on_the_moving_side_see_their_pads_run_backwards(position: float):
    """The same contact described upside down: the bed carries the pads, the slide the rails."""
    swapped = SLIDE.model_copy(
        update={
            "axes": {"x": SLIDE.axes["x"].model_copy(update={"carries": ("bed",)})},
            "supports": {"s": next(iter(SLIDE.supports.values())).model_copy(update={"surface": "plate.z_max"})},
        }
    )
    pairs = contact_ports(swapped, BODIES).pairs
    assert all(p.rail_moves for p in pairs)
    pair = pairs[0]
    stations = np.array(PORTS.rails[0].stations)
    i, right = station_weights(stations, np.array([pair.station - position]))
    T = port_temperatures(50.0, -position)  # seen from the bed, the slide has moved the other way
    on_rail = (1 - right) * T[i] + right * T[i + 1]
    assert abs(on_rail[0] - T[pair.pad_port]) < 1e-10


def test_averages_of_ports_sum_to_one():
    for body in BODIES:
        P, numbers = port_averages(body, PORTS)
        np.testing.assert_allclose(P.sum(axis=0), 1.0, rtol=1e-13)
        assert [PORTS.parts[i] for i in numbers] == [PORTS.names[i].split(".")[0] for i in numbers]
    assert sorted(n for b in BODIES for n in port_averages(b, PORTS)[1]) == list(range(len(PORTS.names)))


def test_faults_of_contacts_are_reported_together():
    machine = changed("x_guide", segments=1)
    machine = machine.model_copy(
        update={
            "contacts": {
                **machine.contacts,
                "third": Contact(
                    kind="moving", axis="x", pairs=(("screw.z_max", "nut.z_min"),), conductance=1.0, segments=7
                ),
                "fourth": Contact(kind="moving", axis="x", pairs=(("bed.top", "nut.z_min"),), conductance=1.0),
            }
        }
    )
    with pytest.raises(DescriptionError) as e:
        contact_ports(machine, BODIES)
    said = [p.what for p in e.value.problems]
    assert said == [
        "a rail needs at least 2 segments",
        "rail 'screw.z_max' has 10 segments along 'x' and 7 along 'x'",
        "unknown surface 'top'",
    ]
    with pytest.raises(DescriptionError, match="'y' is not a linear axis"):
        contact_ports(changed("x_screw", axis="y"), BODIES)
    with pytest.raises(DescriptionError, match=r"unknown part in 'column\.top'"):
        find_part(BODIES, "column.top", "contacts.x")
