"""The artefact file: what is written is read, equal input gives equal bytes, damage is told with a remedy."""

import dataclasses
import hashlib
import re
from datetime import UTC, datetime
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic
from full_disk import full_disk

from twin.errors import ArtefactError, TwinError
from twin.rom.artefact import SurfaceField, read_artefact, write_artefact
from twin.rom.content import stamp

MODEL = synthetic.machine()
CERTIFICATE = {
    "scenarios": ("seed 1: blocks", "seed 2: ramp"),
    "confidence": 0.95,
    "temperature_error": tuple(0.001 * i for i in range(len(MODEL.sensors))),
    "displacement_error": tuple((1e-7, 2e-7, 3e-7) for _ in MODEL.poses),
    "orders": (12, 12, 12),
    "nothing": (),
}
FIELD = SurfaceField(
    "body_1", np.arange(12.0).reshape(4, 3), np.array([[0, 1, 2], [1, 2, 3]]), np.ones((4, 12), np.float32),
    np.arange(144.0, dtype=np.float32).reshape(4, 3, 12), np.ones((4, 3, 5), np.float32),
)  # fmt: skip
PROVENANCE = {"machine.toml": "sha256:12", "command": "twin build m.toml", "twin": "0.1.0"}


def write(path, model=MODEL, created=None):
    write_artefact(path, model, "[machine]\nname = 'ü'\n", CERTIFICATE, PROVENANCE, (FIELD,), created)
    return path


@pytest.fixture
def path(tmp_path):
    return write(tmp_path / "a.h5")


def same(a, b):
    """Equal, arrays bit by bit, through dataclasses and tuples."""
    if dataclasses.is_dataclass(a):
        return type(a) is type(b) and all(same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    if isinstance(a, np.ndarray):
        return a.shape == b.shape and np.array_equal(a, b)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return a == b


@pytest.mark.parametrize("model", [MODEL, synthetic.oblique(MODEL)], ids=["galerkin", "oblique"])
def test_what_is_written_is_read(tmp_path, model):
    artefact = read_artefact(write(tmp_path / "a.h5", model))
    assert same(artefact.model, model)
    assert artefact.model.bodies[0].symmetric == model.bodies[0].symmetric
    assert artefact.description == "[machine]\nname = 'ü'\n"
    assert artefact.provenance == PROVENANCE
    assert same(artefact.fields[0], FIELD)
    bare = dataclasses.replace(FIELD, displacement=None, flexibility=None)  # as older ones, and calibrated expansions
    write_artefact(tmp_path / "b.h5", model, fields=(bare,))
    assert same(read_artefact(tmp_path / "b.h5").fields[0], bare)
    assert set(artefact.certificate) == set(CERTIFICATE)
    assert artefact.certificate["scenarios"] == list(CERTIFICATE["scenarios"])
    np.testing.assert_array_equal(artefact.certificate["displacement_error"], CERTIFICATE["displacement_error"])


def test_equal_input_gives_equal_bytes_but_for_the_time(tmp_path):
    a = write(tmp_path / "a.h5", created=datetime(2026, 11, 21, 10, 0, 0, tzinfo=UTC))
    b = write(tmp_path / "b.h5", created=datetime(2031, 1, 2, 3, 4, 5, tzinfo=UTC))
    again = write(tmp_path / "c.h5", created=datetime(2026, 11, 21, 10, 0, 0, tzinfo=UTC))
    assert a.read_bytes() == again.read_bytes()
    assert a.read_bytes() != b.read_bytes()
    masked = [re.sub(rb"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\dZ|[0-9a-f]{64}", b"T", p.read_bytes()) for p in (a, b)]
    assert hashlib.sha256(masked[0]).digest() == hashlib.sha256(masked[1]).digest()


def test_every_number_has_a_unit_and_every_dimension_a_name(path):
    without = []

    def visit(name, item):
        if not isinstance(item, h5py.Dataset) or item.is_scale:
            return
        if item.dtype.kind == "f" and "units" not in item.attrs and "orders" not in name:
            without.append(name)
        without.extend(f"{name}[{i}]" for i, dim in enumerate(item.dims) if len(dim) != 1)

    with h5py.File(path) as f:
        f.visititems(visit)
        assert f["bodies/body_0/E"].attrs["units"] == "J/K"
        assert f["certificate/displacement_error"].attrs["units"] == "m"
    assert without == []


def test_opens_in_xarray(path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    root = xarray.open_dataset(path, engine="h5netcdf")
    assert root["pose_position"].dims == ("pose", "pose_axis")
    body = xarray.open_dataset(path, engine="h5netcdf", group="bodies/body_1")
    assert body["G"].dims == ("pose", "component", "state")
    assert body["G"].attrs["units"] == "m/K"


def test_the_digest_is_that_of_the_model(path, tmp_path):
    digest = read_artefact(path).digest
    write_artefact(tmp_path / "b.h5", MODEL, certificate={"step": 60.0}, created=datetime(2030, 1, 1, tzinfo=UTC))
    assert read_artefact(tmp_path / "b.h5").digest == digest
    bodies = (dataclasses.replace(MODEL.bodies[0], A0=MODEL.bodies[0].A0 * (1 + 1e-15)), *MODEL.bodies[1:])
    signals = dataclasses.replace(MODEL.load_model, signals=MODEL.load_model.signals[::-1])
    for other in (dataclasses.replace(MODEL, bodies=bodies), dataclasses.replace(MODEL, load_model=signals)):
        assert read_artefact(write(tmp_path / "c.h5", other)).digest != digest


def test_bodies_keep_their_order(tmp_path):
    names = ("slide", "bed", "table")
    bodies = tuple(dataclasses.replace(b, name=n) for b, n in zip(MODEL.bodies, names, strict=True))
    write_artefact(tmp_path / "a.h5", dataclasses.replace(MODEL, bodies=bodies))
    assert tuple(b.name for b in read_artefact(tmp_path / "a.h5").model.bodies) == names


def damaged(path, change):
    """A file that somebody changed and gave the hash of what it now holds."""
    with h5py.File(path, "r+") as f:
        change(f)
    with h5py.File(path, "r+") as f:
        stamp(f)
    return path


def refuse(path):
    with pytest.raises(ArtefactError) as caught:
        read_artefact(path)
    (problem,) = caught.value.problems
    assert str(path) in problem.where
    assert problem.remedy
    return problem


def test_a_missing_file_and_a_file_of_another_kind(tmp_path):
    assert "no such file" in refuse(tmp_path / "nothing.h5").what
    text = tmp_path / "text.h5"
    text.write_text("hello")
    assert "not an HDF5 file" in refuse(text).what
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as f:
        f["x"] = 1
    assert "no artefact" in refuse(other).what


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(path, share):
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    problem = refuse(path)
    assert "truncated" in problem.what
    assert "twin build" in problem.remedy


def test_a_future_schema_version(path):
    problem = refuse(damaged(path, lambda f: f.attrs.__setitem__("schema_version", 4)))
    assert "version 4" in problem.what
    assert "update" in problem.remedy


def test_an_older_schema_version_has_no_hash_and_is_built_again(path):
    def older(f):
        f.attrs["schema_version"] = 2
        del f.attrs["content_sha256"]

    with h5py.File(path, "r+") as f:
        older(f)
    problem = refuse(path)
    assert "version 2" in problem.what
    assert "twin build" in problem.remedy


@pytest.mark.parametrize("name", ["bodies/body_1/A0", "load_model", "pose_grid_x", "certificate", "sensor"])
def test_a_missing_dataset_is_named(path, name):
    def remove(f):
        del f[name]

    assert name in refuse(damaged(path, remove)).what


def test_a_matrix_that_does_not_fit_is_named(path):
    def replace(f):
        del f["bodies/body_2/P"]
        f["bodies/body_2/P"] = np.zeros((2, 2))

    assert "bodies/body_2/P" in refuse(damaged(path, replace)).what


def test_a_full_disk_leaves_the_old_file_and_nothing_else(path):
    before = path.read_bytes()
    with pytest.raises(TwinError, match="cannot write"), full_disk():
        write(path)
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == ["a.h5"]


def test_the_example_of_the_documentation_runs(path, tmp_path, monkeypatch):
    text = (Path(__file__).parents[2] / "docs" / "artefact.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    assert len(code.strip().splitlines()) <= 10
    monkeypatch.chdir(tmp_path)
    path.rename(tmp_path / "A.h5")
    names: dict = {}
    exec(code, names)
    # the example reads the steady temperature rise of the sensors of a body under 1 W/(m^2 K) more everywhere
    body = MODEL.bodies[1]
    expected = body.C @ body.one
    np.testing.assert_allclose(names["rise"], expected, rtol=1e-9)
