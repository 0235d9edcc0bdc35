"""The artefact: one HDF5 file with everything the runtime needs (schema version 2, docs/artefact.md)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from twin.errors import ArtefactError
from twin.rom.hdf5_file import put, put_attributes, scale, strings, writing
from twin.rom.load_model import LoadModel
from twin.rom.model import AffineBody, MachineModel
from twin.rom.parameter import Parameter
from twin.rom.structure_file import read_structure, write_structure
from twin.rom.tcp import refuse_other_structure

FORMAT = "twin artefact"
SCHEMA_VERSION = 2

_PAPERS = ("certificate", "fields", "description", "parameters")  # what results do not depend on

# Dataset of a body -> (unit, dimensions). `equation` counts rows, `state` columns: they differ for oblique projections.
_MATRICES: dict[str, tuple[str, tuple[str, ...]]] = {
    "E": ("J/K", ("equation", "state")),
    "A0": ("W/K", ("equation", "state")),
    "A": ("m^2", ("theta", "equation", "state")),
    "M": ("m^2", ("equation", "theta")),
    "H": ("m^3", ("equation", "theta")),
    "B": ("1", ("equation", "sources")),
    "B_out": ("1", ("state", "sources")),
    "P": ("1", ("equation", "ports")),
    "P_out": ("1", ("state", "ports")),
    "C": ("1", ("sensors", "state")),
    "G": ("m/K", ("pose", "component", "state")),
    "one": ("K", ("state",)),
    "energy": ("J/K", ("state",)),
    "E_members": ("J/K", ("member", "equation", "state")),
    "G_members": ("m/K", ("member", "pose", "component", "state")),
    "W": ("m/K", ("elastic_input", "state")),
    "W_members": ("m/K", ("member", "elastic_input", "state")),
}
_OPTIONAL = ("H", "B_out", "P_out", "E_members", "G_members", "W", "W_members")
_INDICES = {"theta": "theta", "sources": "source", "ports": "port", "sensors": "sensor"}  # into root coordinates


@dataclass(frozen=True)
class SurfaceField:
    """The temperature field of a body on its surface mesh, for pictures: T - T_ref = basis @ x."""

    body: str
    nodes: np.ndarray  # (m, 3) m, machine coordinates at axis positions zero
    triangles: np.ndarray  # (t, 3) int
    basis: np.ndarray  # (m, n) K per unit of state


@dataclass(frozen=True)
class Artefact:
    """A reduced machine with its papers."""

    model: MachineModel
    description: str  # machine.toml
    certificate: dict[str, Any]  # JSON values; number tables as numpy arrays
    provenance: dict[str, str]  # hashes of inputs, versions, command
    fields: tuple[SurfaceField, ...]
    parameters: tuple[Parameter, ...]  # what measurements may correct
    created: str  # ISO 8601, UTC
    digest: str  # sha256 of the model: what results depend on, not its papers, pictures and date


def write_artefact(
    path: Path,
    model: MachineModel,
    description: str = "",
    certificate: Mapping[str, Any] | None = None,
    provenance: Mapping[str, str] | None = None,
    fields: Sequence[SurfaceField] = (),
    created: datetime | None = None,
    parameters: Sequence[Parameter] = (),
) -> None:
    """Write a dense model. Equal input gives equal bytes apart from the attribute `created` (now by default).

    certificate: JSON-compatible values; (nested) sequences of numbers are stored as arrays, with K or m as their unit
    where their name contains "temperature" or "displacement".
    Raises TwinError if the file cannot be written.
    """
    created = created or datetime.now(UTC)
    with writing(Path(path)) as f:
        put_attributes(f, {"format": FORMAT, "schema_version": SCHEMA_VERSION, "name": model.name})
        f.attrs["created"] = np.bytes_(created.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"))  # fixed length
        put(f, "reference_temperature", float(model.reference_temperature), "degC")
        put(f, "load_model", json.dumps(model.load_model.to_json()), "", (), "sources, films, contacts, signals (JSON)")
        put(f, "description", description, "", (), "machine.toml")
        put(
            f,
            "parameters",
            json.dumps([p.to_json() for p in parameters]),
            "",
            (),
            "what calibration may correct (JSON)",
        )
        _write_coordinates(f, model)
        if model.structure is not None:
            write_structure(f.create_group("structure"), model.structure)
        bodies = f.create_group("bodies")
        for body in model.bodies:
            _write_body(bodies.create_group(body.name), body)
        _write_certificate(f.create_group("certificate"), dict(certificate or {}))
        put_attributes(f.create_group("provenance"), dict(sorted((provenance or {}).items())))
        pictures = f.create_group("fields")
        sizes = {body.name: body.n for body in model.bodies}
        for field in sorted(fields, key=lambda s: s.body):
            if field.basis.shape != (len(field.nodes), sizes[field.body]):
                raise ValueError(f"field basis of {field.body}: {field.basis.shape}")
            _write_field(pictures.create_group(field.body), field)


def _write_coordinates(f: h5py.File, model: MachineModel) -> None:
    load = model.load_model
    scale(f, "body", [b.name for b in model.bodies], "", "bodies: parts joined by fixed contacts")
    scale(f, "theta", load.theta_names, "", "coefficients of affine terms [W/(m^2*K)], totals [W/K]")
    scale(f, "source", [s.name for s in load.sources], "", "heat sources [W]")
    scale(f, "port", load.ports, "", "segments of rails, and pads")
    scale(f, "sensor", model.sensors, "", "structural temperature sensors [degC]")
    scale(f, "ambient_sensor", [name for name, _ in model.ambient_sensors], "", "sensors in the air")
    put(f, "ambient_sensor_environment", np.array([i for _, i in model.ambient_sensors], dtype=np.int64), "",
        ("ambient_sensor",))  # fmt: skip
    scale(f, "component", ("x", "y", "z"), "", "of a displacement, machine coordinates")
    scale(f, "pose", np.arange(len(model.poses)), "", "C order over the pose grid")
    scale(f, "pose_axis", model.pose_axes, "", "axes of the pose grid")
    put(f, "pose_position", np.asarray(model.poses, dtype=float), "m", ("pose", "pose_axis"))
    for axis, nodes in zip(model.pose_axes, model.pose_grid, strict=True):
        scale(f, f"pose_grid_{axis}", np.asarray(nodes, dtype=float), "m", f"grid positions of axis {axis}")


def _write_body(group: h5py.Group, body: AffineBody) -> None:
    scale(group, "state", np.arange(body.n), "", "modal coordinates [K]")
    scale(group, "equation", np.arange(body.n), "", "rows")
    if body.members:
        scale(group, "member", body.members, "", "parts, or nodes and bars: shares of E, G and W")
    if body.W is not None:
        scale(group, "elastic_input", np.arange(len(body.W)), "", "what the structure reads of the temperatures")
    for name, root in _INDICES.items():
        scale(group, name, np.array(getattr(body, name), dtype=np.int64), "", f"index of each {root} in /{root}")
    values = {name: getattr(body, name) for name in _MATRICES} | {
        "A": np.array(body.A).reshape(len(body.theta), body.n, body.n)
    }
    for name, (unit, dims) in _MATRICES.items():
        if values[name] is not None:
            put(group, name, np.asarray(values[name], dtype=float), unit, dims)


def _numbers(value: object) -> np.ndarray | None:
    """Arrays and non-empty (nested) sequences of numbers as a float array, else None."""
    if isinstance(value, np.ndarray):
        return value.astype(float)
    if not isinstance(value, list | tuple) or not value:
        return None
    try:
        table = np.array(value)
    except ValueError:
        return None
    return table.astype(float) if table.dtype.kind in "fi" else None


# Tables of a certificate by the scales that artefacts have anyway; others get their own.
_CERTIFIED: dict[str, tuple[str, ...]] = dict.fromkeys(
    ("temperature_error", "temperature_range", "temperature_error_in_case", "temperature_range_in_case"), ("sensor",)
) | dict.fromkeys(
    ("displacement_error", "displacement_range", "displacement_error_in_case", "displacement_range_in_case"),
    ("pose", "component"),
)


def _write_certificate(group: h5py.Group, certificate: dict[str, Any]) -> None:
    tables = {name: _numbers(value) for name, value in sorted(certificate.items())}
    rest = {name: value for name, value in certificate.items() if tables[name] is None}
    put(group, "json", json.dumps(rest, sort_keys=True), "")
    for name, table in tables.items():
        if table is None:
            continue
        unit = "K" if "temperature" in name else "m" if "displacement" in name or name == "positions" else ""
        dims = _CERTIFIED.get(name)
        if dims is None:
            dims = tuple(f"{name}_{axis}" for axis in range(table.ndim))
            for dim, size in zip(dims, table.shape, strict=True):
                scale(group, dim, np.arange(size))
        put(group, name, table, unit, dims)


def _write_field(group: h5py.Group, field: SurfaceField) -> None:
    for dim, size in (("node", len(field.nodes)), ("triangle", len(field.triangles)), ("corner", 3),
                      ("coordinate", 3), ("state", field.basis.shape[1])):  # fmt: skip
        scale(group, dim, np.arange(size))
    put(group, "nodes", np.asarray(field.nodes, dtype=float), "m", ("node", "coordinate"))
    put(group, "triangles", np.asarray(field.triangles, dtype=np.int32), "", ("triangle", "corner"))
    put(group, "basis", np.asarray(field.basis, dtype=np.float32), "1", ("node", "state"))


def read_artefact(path: Path) -> Artefact:
    """Read and check an artefact.

    Raises ArtefactError where the file is missing, is no HDF5 file, is cut off, is no artefact, has a schema version
    this program does not know, or lacks something.
    """
    path = Path(path)
    rebuild = "build the artefact again with `twin build`"
    if not path.is_file():
        what = "is a folder, not an artefact" if path.is_dir() else "no such file"
        raise ArtefactError(what, str(path), f"check the path, or {rebuild}")
    with path.open("rb") as start:
        signature = start.read(8)
    if signature != b"\x89HDF\r\n\x1a\n":
        raise ArtefactError("not an HDF5 file", str(path), "give an artefact written by `twin build`")
    try:
        with h5py.File(path, "r") as f:
            return _read(f, path)
    except KeyError as e:
        raise ArtefactError(f"damaged artefact: {_plain(e)}", str(path), rebuild) from e
    except (OSError, RuntimeError, ValueError, TypeError) as e:
        raise ArtefactError(f"truncated or damaged file: {_plain(e)}", str(path), f"copy it again, or {rebuild}") from e


def _plain(e: Exception) -> str:
    text = str(e.args[0] if e.args else e)
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] and text[0] in "\"'" else text


def _digest(f: h5py.File) -> str:
    """Hash of all datasets the model consists of: certifying an artefact again does not make it another one."""
    digest = hashlib.sha256()
    names: list[str] = []
    f.visit(names.append)
    for name in sorted(names):
        item = f[name]
        if not isinstance(item, h5py.Dataset) or name.split("/")[0] in _PAPERS:
            continue
        digest.update(f"{name} {item.shape}".encode())
        text = h5py.check_string_dtype(item.dtype) is not None
        digest.update(repr(np.asarray(item.asstr()[...]).tolist()).encode() if text else item[...].tobytes())
    return digest.hexdigest()


def _read(f: h5py.File, path: Path) -> Artefact:
    if f.attrs.get("format") != FORMAT:
        raise ArtefactError("an HDF5 file, but no artefact", str(path), "give an artefact written by `twin build`")
    version = int(f.attrs["schema_version"])
    if version != SCHEMA_VERSION:
        raise ArtefactError(
            f"schema version {version}; this program reads version {SCHEMA_VERSION}",
            str(path),
            "update twin" if version > SCHEMA_VERSION else "build the artefact again with `twin build`",
        )
    load = LoadModel.from_json(json.loads(_dataset(f, "load_model").asstr()[()]))
    axes = strings(_dataset(f, "pose_axis"))
    environments = _dataset(f, "ambient_sensor_environment")[...]
    model = MachineModel(
        name=str(f.attrs["name"]),
        bodies=tuple(_read_body(f, name, len(_dataset(f, "pose"))) for name in strings(_dataset(f, "body"))),
        load_model=load,
        reference_temperature=float(_dataset(f, "reference_temperature")[()]),
        sensors=strings(_dataset(f, "sensor")),
        ambient_sensors=tuple(zip(strings(_dataset(f, "ambient_sensor")), map(int, environments), strict=True)),
        pose_axes=axes,
        pose_grid=tuple(_dataset(f, f"pose_grid_{axis}")[...] for axis in axes),
        poses=_dataset(f, "pose_position")[...],
        structure=read_structure(f["structure"], strings(_dataset(f, "body"))) if "structure" in f else None,
    )
    refuse_other_structure(model)
    certificate = dict(json.loads(_dataset(f, "certificate/json").asstr()[()]))
    for name, dataset in _dataset(f, "certificate").items():
        if name != "json" and not dataset.is_scale:
            certificate[name] = dataset[...]
    return Artefact(
        model=model,
        description=str(_dataset(f, "description").asstr()[()]),
        certificate=certificate,
        provenance={str(k): str(v) for k, v in _dataset(f, "provenance").attrs.items()},
        fields=tuple(
            SurfaceField(name, *(_dataset(f, f"fields/{name}/{part}")[...] for part in ("nodes", "triangles", "basis")))
            for name in _dataset(f, "fields")
        ),
        parameters=_parameters(f),
        created=f.attrs["created"].decode(),
        digest=_digest(f),
    )


def _parameters(f: h5py.File) -> tuple[Parameter, ...]:
    if "parameters" not in f:  # written before there were any
        return ()
    return tuple(Parameter.from_json(p) for p in json.loads(f["parameters"].asstr()[()]))


def _dataset(f: h5py.File, name: str) -> Any:
    if name not in f:
        raise KeyError(f"'{name}' is missing")
    return f[name]


def _read_body(f: h5py.File, name: str, n_poses: int) -> AffineBody:
    def get(part: str) -> np.ndarray:
        return np.asarray(_dataset(f, f"bodies/{name}/{part}")[...])

    indices = {part: tuple(int(i) for i in get(part)) for part in _INDICES}
    values = {part: get(part) for part in _MATRICES if part not in _OPTIONAL or f"bodies/{name}/{part}" in f}
    members = strings(f[f"bodies/{name}/member"]) if f"bodies/{name}/member" in f else ()
    n = len(values["one"])
    sizes = {"equation": n, "state": n, "pose": n_poses, "component": 3, "member": len(members)}
    sizes["elastic_input"] = len(values.get("W", ()))
    sizes |= {k: len(v) for k, v in indices.items()}
    for part, value in values.items():
        if value.shape != tuple(sizes[dim] for dim in _MATRICES[part][1]) or not np.all(np.isfinite(value)):
            raise KeyError(f"'bodies/{name}/{part}' has shape {value.shape} or values that do not fit")
    return AffineBody(
        name=name,
        E=values["E"],
        A0=values["A0"],
        A=tuple(values["A"]),
        theta=indices["theta"],
        M=values["M"],
        B=values["B"],
        sources=indices["sources"],
        P=values["P"],
        ports=indices["ports"],
        C=values["C"],
        sensors=indices["sensors"],
        G=values["G"],
        one=values["one"],
        energy=values["energy"],
        P_out=values.get("P_out"),
        B_out=values.get("B_out"),
        H=values.get("H"),
        members=members,
        E_members=values.get("E_members"),
        G_members=values.get("G_members"),
        W=values.get("W"),
        W_members=values.get("W_members"),
    )
