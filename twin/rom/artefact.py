"""The artefact: one HDF5 file with everything the runtime needs (schema version 3, docs/artefact.md)."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from twin.errors import ArtefactError, TwinError
from twin.rom.body_file import read_body, write_body
from twin.rom.certificate_file import read_certificate, write_certificate
from twin.rom.check_load_model import check_load_model, check_parameters
from twin.rom.check_model import check_model
from twin.rom.content import HASH, ForeignContent, Item, items, stamp
from twin.rom.field_file import SurfaceField, read_field, write_field
from twin.rom.hdf5_file import floats, integers, member, put, put_attributes, scale, text, texts, writing
from twin.rom.load_model import LoadModel
from twin.rom.model import AffineBody, MachineModel
from twin.rom.names import has_control_characters
from twin.rom.parameter import Parameter
from twin.rom.seal import is_broken, sealed
from twin.rom.structure_file import read_structure, write_structure
from twin.rom.tcp import is_exact, refuse_other_structure

FORMAT = "twin artefact"
SCHEMA_VERSION = 3

_Text = TypeVar("_Text", str, bytes)
_PAPERS = ("certificate", "fields", "description", "parameters")  # what results do not depend on


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
    """Write a dense model. Equal input gives equal bytes but for `created` (now by default) and the hash.

    certificate: JSON-compatible values; (nested) sequences of numbers are stored as arrays, with K or m as their unit
    where their name contains "temperature" or "displacement".
    Raises TwinError if the file cannot be written.
    """
    created = created or datetime.now(UTC)
    with writing(Path(path), sealed) as f:
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
            write_body(bodies.create_group(body.name), body)
        write_certificate(f.create_group("certificate"), certificate or {})
        put_attributes(f.create_group("provenance"), dict(sorted((provenance or {}).items())))
        pictures = f.create_group("fields")
        sizes = {body.name: body.n for body in model.bodies}
        for field in sorted(fields, key=lambda s: s.body):
            if field.basis.shape != (len(field.nodes), sizes[field.body]):
                raise ValueError(f"field basis of {field.body}: {field.basis.shape}")
            write_field(pictures.create_group(field.body), field)
        stamp(f)


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


def read_artefact(path: Path) -> Artefact:
    """Read and check an artefact: see `checked_artefact`, which says besides what was checked."""
    return checked_artefact(path)[0]


def checked_artefact(path: Path) -> tuple[Artefact, tuple[str, ...]]:
    """The artefact in a file, and one line per thing that was checked.

    Raises ArtefactError where the file is missing, is no HDF5 file, is cut off, is no artefact, has a schema version
    this program does not know, holds something else than it was written with, links to something, lacks something, or
    holds a model that cannot be: `twin.rom.check_load_model`, `twin.rom.check_model`.
    """
    path = Path(path)
    rebuild = "build the artefact again with `twin build`"
    if not path.is_file():
        what = "is a folder, not an artefact" if path.is_dir() else "no such file"
        raise ArtefactError(what, str(path), f"check the path, or {rebuild}")
    try:
        content = path.read_bytes()
        if not content.startswith(b"\x89HDF\r\n\x1a\n"):
            raise ArtefactError("not an HDF5 file", str(path), "give an artefact written by `twin build`")
        if is_broken(content):
            what = "damaged: its bytes have changed since it was written"
            raise ArtefactError(what, str(path), f"copy it again, or {rebuild}")
        del content
        with h5py.File(path, "r") as f:
            digest, told = _as_written(f, path)
            artefact, more = _read(f, digest)
        return artefact, (*told, *more)
    except KeyError as e:
        raise ArtefactError(f"damaged artefact: {_plain(e)}", str(path), rebuild) from e
    except (OSError, RuntimeError, ValueError, TypeError, ArithmeticError) as e:
        raise ArtefactError(f"truncated or damaged file: {_plain(e)}", str(path), f"copy it again, or {rebuild}") from e


def _plain(e: Exception) -> str:
    text = str(e.args[0] if e.args else e)
    quoted = len(text) > 1 and text[0] == text[-1] and text[0] in "\"'" and text[0] not in text[1:-1]
    return text[1:-1] if quoted else text or type(e).__name__


def _as_written(f: h5py.File, path: Path) -> tuple[str, tuple[str, ...]]:
    """The hash of the model in a file, and what was checked: that all in it is what was written, and stored in it."""
    again = "copy it again, or build the artefact again with `twin build`"
    try:
        if f.attrs.get("format") != FORMAT:
            raise ArtefactError("an HDF5 file, but no artefact", str(path), "give an artefact written by `twin build`")
        version = int(f.attrs["schema_version"])
        if version != SCHEMA_VERSION:
            what = f"schema version {version}; this program reads version {SCHEMA_VERSION}"
            remedy = "update twin" if version > SCHEMA_VERSION else "build the artefact again with `twin build`"
            raise ArtefactError(what, str(path), remedy)
        content, model, counts = _hashes(f)
        stored = f.attrs[HASH]
    except ForeignContent as e:
        raise ArtefactError(
            f"'{e.args[1]}' is {e.args[0]}", str(path), f"an artefact holds all it needs: {again}"
        ) from e
    except TwinError:
        raise
    except Exception as e:  # of a damaged file h5py may raise anything, AttributeError and MemoryError among it
        raise ArtefactError(f"truncated or damaged file: {_plain(e)}", str(path), again) from e
    if not isinstance(stored, bytes) or stored.decode("ascii", "replace") != content:
        what = f"changed since it was written: its content is {content[:12]}..., not what its {HASH} says"
        raise ArtefactError(what, str(path), again)
    return model, (
        f"content: {counts['dataset']} datasets, {counts['group']} groups and {counts['attribute']} attributes "
        f"have the SHA-256 {content[:16]}... that they were written with",
        "storage: no soft or external links, no data in other files, nothing gathered or compressed",
    )


def _hashes(f: h5py.File) -> tuple[str, str, Counter[str]]:
    """Hash of all content, hash of the datasets the model consists of, and how many objects there are of each kind.

    The second names the model: certifying an artefact again does not make it another one.
    """
    content, model, counts = hashlib.sha256(), hashlib.sha256(), Counter[str]()
    for item in items(f):
        counts[item.kind] += 1
        for digest in (content, model) if item.kind == "dataset" and _is_model(item) else (content,):
            digest.update(item.head)
            digest.update(item.data)
    return content.hexdigest(), model.hexdigest(), counts


def _is_model(item: Item) -> bool:
    return item.path.split("/")[1] not in _PAPERS


def _read(f: h5py.File, digest: str) -> tuple[Artefact, tuple[str, ...]]:
    load = LoadModel.from_json(json.loads(text(f, "load_model")))
    told = [f"load model: {check_load_model(load)}"]
    for name, wanted in (("theta", load.theta_names), ("port", load.ports), ("source", [s.name for s in load.sources])):
        if texts(f, name) != tuple(wanted):
            raise KeyError(f"'{name}' does not name what load_model does")
    axes, names, poses = texts(f, "pose_axis"), texts(f, "body"), floats(f, "pose_position")
    environments = integers(f, "ambient_sensor_environment").tolist()
    bodies = member(f, "bodies")
    model = MachineModel(
        name=_attribute(f, "name", str),
        bodies=tuple(read_body(member(bodies, name, "bodies"), name, len(poses), len(axes)) for name in names),
        load_model=load,
        reference_temperature=float(floats(f, "reference_temperature")),
        sensors=texts(f, "sensor"),
        ambient_sensors=tuple(zip(texts(f, "ambient_sensor"), environments, strict=True)),
        pose_axes=axes,
        pose_grid=tuple(floats(f, f"pose_grid_{axis}") for axis in axes),
        poses=poses,
        structure=read_structure(f["structure"], names) if "structure" in f else None,
    )
    told += [f"body {line}" for line in check_model(model)]
    refuse_other_structure(model)
    if is_exact(model):
        told.append("structure: solved at the first pose, gives the TCP rows that are stored")
    artefact = Artefact(
        model=model,
        description=text(f, "description"),
        certificate=read_certificate(member(f, "certificate")),
        provenance={str(k): str(v) for k, v in member(f, "provenance").attrs.items()},
        fields=_fields(member(f, "fields"), model),
        parameters=_parameters(f, load, model.bodies),
        created=_attribute(f, "created", bytes).decode("ascii"),
        digest=digest,
    )
    return artefact, tuple(told)


def _attribute(f: h5py.File, name: str, kind: type[_Text]) -> _Text:
    """An attribute of the root. Raises KeyError where it is of another type, or holds control characters."""
    value = f.attrs[name]
    if not isinstance(value, kind) or (isinstance(value, str) and has_control_characters(value)):
        raise KeyError(f"attribute '{name}' is no {kind.__name__} without control characters")
    return value


def _fields(group: h5py.Group, model: MachineModel) -> tuple[SurfaceField, ...]:
    sizes = {body.name: body.n for body in model.bodies}
    foreign = [name for name in group if name not in sizes]
    if foreign:
        raise KeyError(f"'fields/{foreign[0]}' is of no body")
    turning = len(model.load_model.rotary)
    return tuple(read_field(group[name], name, sizes[name], turning) for name in group)


def _parameters(f: h5py.File, load: LoadModel, bodies: Sequence[AffineBody]) -> tuple[Parameter, ...]:
    if "parameters" not in f:  # it is optional
        return ()
    parameters = tuple(Parameter.from_json(p) for p in json.loads(text(f, "parameters")))
    check_parameters(parameters, load, bodies)
    return parameters
