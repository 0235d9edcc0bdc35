"""The channels file, TOML: nodes of OPC UA servers, users, what a value cannot be, where corrections go."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from twin.errors import TwinError
from twin.live.facts import Facts
from twin.units import parse_unit, to_si

_KEYS = {"opcua", "mqtt", "channels", "outputs"}
_CHANNEL = {"node", "unit", "low", "high", "rate"}
_OPCUA = {"interval", "certificate", "key", "server_certificate", "user", "password_file", "heartbeat", "drives"}
_MQTT = {"user", "password_file", "ca", "certificate", "key", "client"}
_FILES = ("certificate", "key", "server_certificate", "ca", "password_file")
_OUTPUTS = {"offsets", "count", "good_until", "mode"}


@dataclass(frozen=True)
class Channels:
    """A channels file as read; of none, everything is empty."""

    folder: Path = Path(".")
    opcua: dict[str, Any] = field(default_factory=dict)
    mqtt: dict[str, Any] = field(default_factory=dict)
    nodes: dict[str, tuple[str, str]] = field(default_factory=dict)  # column -> node, unit
    units: dict[str, str] = field(default_factory=dict)  # column -> unit, where the file says so
    limits: dict[str, dict[str, float]] = field(default_factory=dict)  # column -> low, high, rate in SI
    outputs: dict[str, str] = field(default_factory=dict)

    def refuse_missing(self, name: str) -> None:
        """Raises TwinError for a file that the table `name` names and that is not there."""
        told = {"opcua": self.opcua, "mqtt": self.mqtt}[name]
        for key in _FILES:
            if key in told and not (self.folder / told[key]).is_file():
                raise TwinError(f"{key}: no file '{told[key]}'", name, "paths are relative to the channels file")


def read_channels(path: Path | None, facts: Facts) -> Channels:
    """The file, its limits in SI. Raises TwinError for unknown keys, columns and units."""
    if path is None:
        return Channels()
    import tomllib  # a twentieth of a start, where there is no file

    remedy = "docs/live.md has an example"
    try:
        told = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as e:
        raise TwinError(f"cannot read: {e}", str(path), "check the path") from e
    except tomllib.TOMLDecodeError as e:
        raise TwinError(f"not valid TOML: {e}", str(path), remedy) from e
    _known(told, _KEYS, path, "")
    _known(told.get("opcua", {}), _OPCUA, path, "opcua")
    _known(told.get("mqtt", {}), _MQTT, path, "mqtt")
    _known(told.get("outputs", {}), _OUTPUTS, path, "outputs")
    _whole(told.get("opcua", {}), path, "opcua")
    _whole(told.get("mqtt", {}), path, "mqtt")
    units = {c.column: c.unit for c in facts.channels} | dict.fromkeys(facts.sensors, "degC")
    nodes, limits, written = {}, {}, {}
    named = told.get("channels", {})
    if not isinstance(named, dict):
        raise TwinError("channels is no table", str(path), remedy)
    for column, own in named.items():
        if column not in units:
            raise TwinError(f"no channel '{column}'", str(path), f"channels are: {', '.join(units)}")
        _known(own, _CHANNEL, path, f"channels.{column}")
        where, unit = f"{path}: channels.{column}", units[column]
        if "unit" in own:
            _checked(own["unit"], unit, where)
            written[column] = str(own["unit"])
        if "node" in own:
            nodes[column] = (str(own["node"]), written.get(column, unit))
        limits[column] = {k: _si(own[k], unit, k, where) for k in ("low", "high", "rate") if k in own}
        if limits[column].get("low", -math.inf) >= limits[column].get("high", math.inf):
            raise TwinError("low is not below high", where, "exchange them")
    opcua, mqtt, outputs = (told.get(name, {}) for name in ("opcua", "mqtt", "outputs"))
    return Channels(path.parent, opcua, mqtt, nodes, written, limits, outputs)


def _whole(told: dict[str, Any], path: Path, name: str) -> None:
    """Raises TwinError for what is of no use without its companion, and for what is no text."""
    for key, other in (("user", "password_file"), ("certificate", "key"), ("key", "certificate")):
        if key in told and other not in told and (name, key) != ("mqtt", "user"):
            raise TwinError(f"{key} without {other}", f"{path}: {name}", f'write {other} = "..." beside it')
    drives = told.get("drives", {})
    if not isinstance(drives, dict) or not all(isinstance(v, str) for v in drives.values()):
        raise TwinError("drives is no table of texts", f"{path}: {name}", "write drives = { x = 'X1' }")
    for key, value in told.items():
        if not isinstance(value, str) and key not in ("interval", "drives"):
            raise TwinError(f"{key} is no text", f"{path}: {name}", f'write {key} = "..."')
    _interval(told.get("interval", "0.1 s"), path, name)


def _interval(value: Any, path: Path, name: str) -> None:
    try:
        sound = 0.0 < to_si(value, "s") < 3600.0
    except (ValueError, TypeError):
        sound = False
    if not sound:
        raise TwinError(f"interval: {value!r} is no time above zero", f"{path}: {name}", 'write interval = "0.1 s"')


def _known(table: dict[str, Any], keys: set[str], path: Path, name: str) -> None:
    if not isinstance(table, dict):
        raise TwinError(f"{name} is no table", str(path), f"write [{name}] and keys below it")
    unknown = [k for k in table if k not in keys]
    if unknown:
        raise TwinError(
            f"unknown keys: {', '.join(unknown)}", f"{path}: {name}", f"keys are: {', '.join(sorted(keys))}"
        )


def _checked(text: Any, unit: str, where: str) -> None:
    try:
        found = parse_unit(str(text)).si
    except ValueError as e:
        raise TwinError(str(e), where, f"write a unit of {unit}") from e
    if found != unit:
        raise TwinError(f"unit {text} is not of {unit}", where, f"write a unit of {unit}")


def _si(value: Any, unit: str, key: str, where: str) -> float:
    """A limit; a rate is a number in SI per second."""
    try:
        return float(value) if key == "rate" else to_si(value, unit)
    except (ValueError, TypeError) as e:
        remedy = f"write a number in {unit}/s" if key == "rate" else f"write a number in {unit}, or one with its unit"
        raise TwinError(f"{key}: {e}", where, remedy) from e
