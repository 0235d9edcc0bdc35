"""Nodes by the names of OPC 40502, found on a real server on 127.0.0.1 whose address space is made of them."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from dataclasses import replace

import pytest

asyncua = pytest.importorskip("asyncua")

from asyncua import ua  # noqa: E402

from tests.live.scripted import FACTS  # noqa: E402
from twin.errors import TwinError  # noqa: E402
from twin.live.channels import Channels, read_channels  # noqa: E402
from twin.live.cnc import NAMESPACE  # noqa: E402
from twin.live.facts import Channel  # noqa: E402
from twin.live.opcua import OpcUaSource  # noqa: E402

pytestmark = pytest.mark.long

WANTED = (
    Channel("x_position", "m", True, None, 0.0, 0.5, "x"),
    Channel("swivel_angle", "rad", True, None, -2.0, 2.0, "b"),
    Channel("x_torque", "N*m", True, None, 0.0, 40.0),
    Channel("spindle_speed", "1/s", True, None, 0.0, 200.0),
    Channel("spindle_power", "W", True, None, 0.0, 2e4),
    Channel("y_load", "1", False, None, 0.0, 1.0),  # nothing reads it, and there is no such axis
    Channel("coolant", "degC", True, 20.0, 10.0, 40.0),  # has a default, and no name in the standard
)
OWN = replace(FACTS, channels=WANTED, axis_channels=(0,))
LONG, SLOW = pytest.mark.long, pytest.mark.slow  # a server starts in seconds
UNITS = {"mm": "MMT", "deg": "DD", "Nm": "NU", "rpm": "RPM", "kW": "KWT"}


class Machine:
    """A control whose axes and spindles are where some vendor has put them, in a thread of its own."""

    def __init__(self):
        self.loop = asyncio.new_event_loop()
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            self.url = f"opc.tcp://127.0.0.1:{s.getsockname()[1]}"
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()

    def do(self, coroutine):
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop).result(30)

    async def begin(self, axes=("X", "B"), spindles=("S1",), unit="mm", interfaces=1):
        self.server = asyncua.Server()
        await self.server.init()
        self.server.set_endpoint(self.url)
        self.server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
        await self.server.register_namespace("urn:vendor")
        self.space = await self.server.register_namespace(NAMESPACE)
        self.nodes = {}
        folder = await self.server.nodes.objects.add_folder(2, "Plant")
        for k in range(interfaces):
            interface = await folder.add_object(self.space, f"CncInterface{k or ''}")
            rows = await interface.add_object(self.space, "CncAxisList")
            await rows.add_property(0, "NodeVersion", "1")
            for name in axes:
                await self._axis(rows, name, "deg" if name == "B" else unit)
            rows = await interface.add_object(self.space, "CncSpindleList")
            for name in spindles:
                spindle = await self._drive(rows, name)
                await self._variable(spindle, name, "ActSpeed", 1200.0, "rpm")
        await self.server.start()

    async def _drive(self, rows, name):
        drive = await rows.add_object(self.space, name)
        await self._variable(drive, name, "ActLoad", 30.0, "")
        await self._variable(drive, name, "ActPower", 1.5, "kW")
        await self._variable(drive, name, "ActTorque", 4.0, "Nm")
        return drive

    async def _axis(self, rows, name, unit):
        axis = await self._drive(rows, name)
        for k, place in enumerate(("PosDirect", "PosIndirect")):
            group = await self._variable(axis, name, place, 0.0, unit)
            await self._variable(group, f"{name}.{place}", "CmdPos", 0.0, "")
            await self._variable(group, f"{name}.{place}", "ActPos", 90.0 + k, "")

    async def _variable(self, parent, owner, name, value, unit):
        made = await parent.add_variable(self.space, name, value)
        if unit:
            code = int.from_bytes(UNITS[unit].encode(), "big")
            told = ua.EUInformation("http://www.opcfoundation.org/UA/units/un/cefact", code, ua.LocalizedText(unit))
            await made.add_property(self.space, "EngineeringUnits", told)
        self.nodes[f"{owner}.{name}"] = made
        return made

    def bad(self, name):
        value = ua.DataValue(ua.Variant(0.0, ua.VariantType.Double), ua.StatusCode(ua.StatusCodes.BadNotSupported))
        self.do(self.server.write_attribute_value(self.nodes[name].nodeid, value))

    def stop(self):
        self.do(self.server.stop())
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join(10)


@pytest.fixture
def machine():
    made = Machine()
    yield made
    made.stop()


def first(source, seconds=20.0):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        for block in source.poll(0.3):
            return dict(zip(block.names, block.values[: len(block.names)], strict=True))
    raise AssertionError(source.error)


def test_axes_and_spindles_are_found_and_read_in_si(machine):
    machine.do(machine.begin())
    source = OpcUaSource(machine.url, Channels(opcua={"interval": "20 ms"}), OWN)
    try:
        assert first(source) == pytest.approx(
            {"x_position": 0.090, "swivel_angle": 1.5707963267948966, "x_torque": 4.0, "spindle_speed": 20.0,
             "spindle_power": 1500.0}
        )  # fmt: skip
    finally:
        source.close()


def test_an_axis_without_a_direct_scale_tells_its_indirect_position(machine):
    machine.do(machine.begin())
    machine.bad("X.PosDirect.ActPos")
    source = OpcUaSource(machine.url, Channels(opcua={"interval": "20 ms"}), OWN)
    try:
        assert first(source)["x_position"] == pytest.approx(0.091)
    finally:
        source.close()


def test_a_file_says_what_the_server_calls_a_drive_and_names_the_rest(machine, tmp_path):
    machine.do(machine.begin(axes=("X1", "B"), spindles=("S1", "S2"), unit=""))
    (tmp_path / "channels.toml").write_text(
        '[opcua]\ninterval = "20 ms"\ndrives = { x = "X1", spindle = "s2" }\n[channels.x_position]\nunit = "mm"\n'
        f'[channels.coolant]\nnode = "{machine.nodes["X1.ActLoad"].nodeid.to_string()}"\n'
    )
    source = OpcUaSource(machine.url, read_channels(tmp_path / "channels.toml", OWN), OWN)
    try:
        found = first(source)
        assert (found["x_position"], found["spindle_speed"], found["coolant"]) == pytest.approx((0.090, 20.0, 30.0))
    finally:
        source.close()


@pytest.mark.parametrize(
    ("begun", "told"),
    [
        ({"axes": ("Y", "B")}, r"axes Y, B, spindles S1\): x_position: no axis is called 'x'; x_torque: no drive"),
        pytest.param({"spindles": ("S1", "S2")}, "spindle_speed: no spindle is called 'spindle'", marks=SLOW),
        pytest.param({"interfaces": 2}, "x_position: 2 drives are called 'x'", marks=SLOW),
        pytest.param({"unit": ""}, "x_position: the server states no unit of it", marks=SLOW),
        pytest.param({"unit": "kW"}, "x_position: is in kW", marks=LONG),
    ],
)
def test_what_is_not_there_or_not_clear_is_one_error(machine, begun, told):
    machine.do(machine.begin(**begun))
    with pytest.raises(TwinError, match=told) as e:
        OpcUaSource(machine.url, Channels(), OWN)
    assert "channels file" in str(e.value)
    assert e.value.status == 1  # not 2, after which nobody would start it again


@LONG
def test_a_channel_without_a_name_is_one_error(machine):
    machine.do(machine.begin())
    more = (Channel("x_current", "A", True, None, 0.0, 20.0), Channel("x_speed", "m/s", True, None, 0.0, 1.0))
    current = replace(OWN, channels=(*WANTED, *more))
    told = "x_current: the standard has no such name; x_speed: the standard has no speed of an axis"
    with pytest.raises(TwinError, match=told):
        OpcUaSource(machine.url, Channels(), current)


@LONG
def test_a_server_that_comes_later_is_waited_for_and_told_of(machine):
    source = OpcUaSource(machine.url, Channels(opcua={"interval": "20 ms"}), OWN)
    try:
        assert list(source.poll(0.3)) == []
        machine.do(machine.begin(axes=("Y", "B")))
        until = time.monotonic() + 20.0
        while "no axis is called 'x'" not in source.error and time.monotonic() < until:
            assert list(source.poll(0.3)) == []
        assert "no axis is called 'x'" in source.error
    finally:
        source.close()
