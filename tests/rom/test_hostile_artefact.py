"""Artefacts that somebody damaged or edited: each is one clear error, with what, where and remedy, and exit status 2.

What the hash of the content cannot see, because it was made anew, the checks of the model do.
"""

from __future__ import annotations

import json
import os
import random
import re
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic
import synthetic_run

from twin.cli.main import run
from twin.errors import ArtefactError, Problem
from twin.rom.artefact import SurfaceField, read_artefact, write_artefact
from twin.rom.content import content_hash, stamp

MODEL = synthetic.machine(2)
A0, E = "bodies/body_0/A0", "bodies/body_0/E"


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return synthetic_run.artefact(tmp_path_factory.mktemp("sound") / "a.h5", MODEL).read_bytes()


@pytest.fixture(scope="module")
def loads(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthetic_run.run_folder(tmp_path_factory.mktemp("loads") / "run", MODEL, hours=0.5)


def put(name, change):
    """Another dataset in place of one: `change` of what it holds."""

    def edit(f):
        values = change(f[name][...])
        del f[name]
        f[name] = values

    return edit


def told(name, *keys, value):
    """Another value in a JSON dataset."""

    def edit(f):
        data = json.loads(f[name].asstr()[()])
        place = data
        for key in keys[:-1]:
            place = place[key]
        place[keys[-1]] = value
        f[name][()] = json.dumps(data)

    return edit


def replaced(name, link):
    def edit(f):
        del f[name]
        f[name] = link

    return edit


def external_storage(f):
    values = f[A0][...]
    raw = Path(f.filename).with_name("elsewhere.raw")
    raw.write_bytes(values.tobytes())
    del f[A0]
    f.create_dataset(A0, values.shape, values.dtype, external=[(str(raw), 0, h5py.h5f.UNLIMITED)])


def compressed(f):
    values = f[A0][...]
    del f[A0]
    f.create_dataset(A0, data=values, compression="gzip")


def enormous(f):
    del f[A0]
    f.create_dataset(A0, shape=(10**6, 10**6), dtype="f8")


def unsymmetric(matrix):
    return matrix + 1e-3 * np.abs(matrix).max() * np.triu(np.ones_like(matrix), 1)


def scaled_sources(f):
    f["bodies/body_0/B"][...] = 41.0 * f["bodies/body_0/B"][...]


EDITS = {
    "whole numbers": (put(A0, lambda a: np.rint(a).astype(np.int64)), "body_0/A0' is of type int64"),
    "single precision": (put(A0, lambda a: a.astype(np.float32)), "body_0/A0' is of type float32"),
    "complex numbers": (put(A0, lambda a: a.astype(complex)), "of type complex128"),
    "not finite": (put(A0, lambda a: a * np.nan), "body_0/A0' holds values that are not finite"),
    "another shape": (put(A0, lambda a: a[:, :-1]), "body_0/A0' has shape (12, 11)"),
    "data in another file": (external_storage, "body_0/A0' is data in the file"),
    "a soft link": (replaced(E, h5py.SoftLink("/" + A0)), "body_0/E' is a soft link to '/bodies/body_0/A0'"),
    "a link to a file": (
        replaced(E, h5py.ExternalLink("b.h5", "/E")),
        "body_0/E' is a link to '/E' in the file 'b.h5'",
    ),
    "two names": (lambda f: replaced(E, f[A0])(f), "body_0/E' is a second name of '/bodies/body_0/A0'"),
    "a group within itself": (lambda f: f["bodies"].__setitem__("again", f["bodies"]), "again' is a second name of"),
    "compressed": (compressed, "body_0/A0' is chunked"),
    "larger than the file": (enormous, "more than the file holds"),
    "E zero": (put(E, lambda e: 0.0 * e), "body_0/E' is not positive definite"),
    "E negative": (put(E, lambda e: -e), "body_0/E' is not positive definite"),
    "E without symmetry": (put(E, unsymmetric), "body_0/E' is not symmetric"),
    "E twice as large": (put(E, lambda e: 2.0 * e), "body_0/energy' is not the heat capacity"),
    "A0 negative": (put(A0, lambda a: -a), "body_0/A0' is not positive semidefinite"),
    "A0 that 1 K sees": (put(A0, lambda a: a + np.eye(12)), "body_0/A0' is not free of heat at 1 K"),
    "a film without symmetry": (put("bodies/body_0/A", lambda a: a + unsymmetric(a[0])), "A[0]' is not symmetric"),
    "sources 41 times as strong": (scaled_sources, "body_0/B' is not 1 W of 1 W"),
    "an index that is not there": (
        lambda f: f["bodies/body_0/theta"].__setitem__(0, 99),
        "bodies/body_0/theta' is 99, and there are",
    ),
    "an index from the end": (lambda f: f["bodies/body_0/ports"].__setitem__(0, -1), "body_0/ports' is -1"),
    "a port twice": (lambda f: f["bodies/body_0/ports"].__setitem__(0, 1), "do not name each of the"),
    "an environment that is not there": (
        told("load_model", "films", 0, "environment", value=7),
        "load_model.films.body_0_natural.environment' is 7, and there are 2",
    ),
    "an index that is no whole number": (told("load_model", "films", 0, "environment", value=0.5), "0.5 is no int"),
    "a signal that is not there": (
        told("load_model", "axes", 0, "position", value="x_positon"),
        "did you mean 'x_position'?",
    ),
    "400 digits": (told("load_model", "signals", 0, "low", value=10**400), "a whole number of 1329 bits is beyond"),
    "a range of 1e200": (told("load_model", "signals", 0, "high", value=1e200), "signals[0].high': 1e+200 is beyond"),
    "infinity": (told("load_model", "signals", 0, "high", value=float("inf")), "inf is beyond"),
    "text as gain": (told("load_model", "sources", 0, "gain", value="1.0"), "sources[0].gain': '1.0' is no number"),
    "a truth value as gain": (told("load_model", "sources", 0, "gain", value=True), "True is no number"),
    "NUL in a name": (told("load_model", "sources", 0, "name", value="x\0y"), "holds control characters"),
    "NUL in a port": (told("load_model", "ports", 0, value="x\0y"), "holds control characters"),
    "a date as a number": (lambda f: f.attrs.__setitem__("created", 1), "attribute 'created' is no bytes"),
    "an escape in the machine's name": (lambda f: f.attrs.__setitem__("name", "\x1b[2J"), "attribute 'name' is no str"),
    "an unknown key": (told("load_model", "sources", 0, "gian", value=2.0), "a Source has no 'gian'"),
    "a negative conductance": (told("load_model", "pairs", 0, "conductance", value=-1.0), "a conductance below 0"),
    "a reference in kelvin": (
        put("reference_temperature", lambda t: t + 273.15),
        "reference_temperature': 293.15 degC is no temperature of a machine: in kelvin?",
    ),
    "substeps by the billion": (told("certificate/json", "substeps", value=10**9), "1e+09 substeps"),
    "poses of another grid": (put("pose_position", lambda p: p[::-1].copy()), "'pose_position' is not that of"),
    "an unknown law": (
        told("load_model", "sources", 0, "use", "law", value="motor_coper"),
        "did you mean 'motor_copper'?",
    ),
    "a parameter of no law": (
        told("load_model", "sources", 0, "use", "parameters", "resistence", value=1.0),
        "law 'motor_copper' has no 'resistence'",
    ),
    "a negative resistance": (
        told("load_model", "sources", 0, "use", "parameters", "resistance", value=-1.0),
        "resistance is -1, not 0 ..",
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_with_a_new_hash_is_one_clear_error(sound, loads, tmp_path, capsys, edit):
    path = tmp_path / "a.h5"
    path.write_bytes(sound)
    change, what = EDITS[edit]
    with h5py.File(path, "r+") as f:
        change(f)
        try:
            stamp(f)
        except Exception:  # what cannot be hashed is refused before the hash is looked at
            assert edit in ("data in another file", "a soft link", "a link to a file", "two names", "complex numbers",
                            "a group within itself", "compressed", "larger than the file")  # fmt: skip
    assert run(["run", str(path), str(loads), "-o", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert what in told
    assert told.count("error: ") == told.count("remedy: ") == 1
    assert "Traceback" not in told
    assert not (tmp_path / "out").exists()
    assert run(["info", "--check", str(path)]) == 2
    assert what in capsys.readouterr().err


def test_an_edit_with_the_old_hash_is_found_whatever_it_changes(sound, tmp_path, capsys):
    path = tmp_path / "a.h5"
    for change in (
        lambda f: f[A0].__setitem__((0, 0), np.nextafter(f[A0][0, 0], 1.0)),
        lambda f: f[A0].attrs.__setitem__("units", "kW/K"),
        lambda f: f.attrs.__setitem__("name", "another"),
        lambda f: f["provenance"].attrs.__setitem__("command", "none"),
        lambda f: f.__setitem__("more", 1.0),
        lambda f: f.attrs.__delitem__("created"),
        lambda f: f.attrs.__delitem__("content_sha256"),
    ):
        path.write_bytes(sound)
        with h5py.File(path, "r+") as f:
            change(f)
        assert run(["info", str(path)]) == 2
        told = capsys.readouterr().err
        assert "changed since it was written" in told or "content_sha256" in told


def test_changed_bytes_never_reach_hdf5(sound, tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    path.write_bytes(sound)
    read_artefact(path)
    path.write_bytes(sound[:500] + bytes([sound[500] ^ 1]) + sound[501:])
    monkeypatch.setattr(h5py, "File", None)
    problem = refusal(path)
    assert problem is not None
    assert "its bytes have changed" in problem.what


def test_a_file_without_its_seal_is_read_by_the_hash_of_its_content(sound, tmp_path):
    path = tmp_path / "a.h5"
    path.write_bytes(sound[:-78])
    assert b"twin sha256" in sound[-78:]
    assert b"twin sha256" not in path.read_bytes()
    assert refusal(path) is None


def test_a_file_that_was_rewritten_with_the_same_content_keeps_its_hash(sound, tmp_path):
    path = tmp_path / "a.h5"
    path.write_bytes(sound)
    digest = read_artefact(path).digest
    with h5py.File(path, "r+") as f:
        for name in ("load_model", "description"):
            values, attributes = f[name][()], dict(f[name].attrs)
            del f[name]
            f.create_dataset(name, data=values, dtype=h5py.string_dtype("utf-8")).attrs.update(attributes)
    assert path.read_bytes() != sound
    assert read_artefact(path).digest == digest


def refusal(path: Path) -> Problem | None:
    """Why an artefact is refused, None where it is read."""
    try:
        read_artefact(path)
    except ArtefactError as e:
        (problem,) = e.problems
        return problem
    return None


def flips(content: bytes, path: Path, count: int, seed: int) -> int:
    """Read a file so often, each time with another bit of it changed; how often it is refused."""
    path.write_bytes(content)
    with h5py.File(path) as f:
        right = content_hash(f)
    rng, refused = random.Random(seed), 0
    for _ in range(count):
        at, bit = rng.randrange(len(content)), rng.randrange(8)
        path.write_bytes(content[:at] + bytes([content[at] ^ 1 << bit]) + content[at + 1 :])
        problem = refusal(path)
        if problem is None:  # a byte that holds nothing
            with h5py.File(path) as f:
                assert content_hash(f) == right, (at, bit)
        else:
            assert str(path) in problem.where
            assert problem.remedy
            refused += 1
    return refused


def test_flipped_bits_are_found(sound, tmp_path):
    assert flips(sound, tmp_path / "a.h5", 100, seed=1) > 98


@pytest.mark.long
def test_a_thousand_flipped_bits_are_found(sound, tmp_path):
    count = int(os.environ.get("TWIN_FLIPS", "1000"))
    assert flips(sound, tmp_path / "a.h5", count, seed=2) > 0.99 * count


def test_the_check_takes_no_more_than_a_fifth_of_a_second_per_25_megabytes(tmp_path):
    path, n = tmp_path / "a.h5", MODEL.bodies[0].n
    nodes = np.zeros((25_000_000 // (4 * n + 24), 3))
    field = SurfaceField("body_0", nodes, np.zeros((0, 3)), np.ones((len(nodes), n), np.float32))
    write_artefact(path, MODEL, fields=[field])
    assert path.stat().st_size > 25_000_000
    seconds = []
    for _ in range(5):
        begin = time.process_time()
        with h5py.File(path) as f:
            content_hash(f)
        seconds.append(time.process_time() - begin)
    assert min(seconds) < 0.2, seconds


def test_the_check_says_what_was_checked(sound, tmp_path, capsys):
    path = tmp_path / "a.h5"
    path.write_bytes(sound)
    assert run(["info", "--check", str(path)]) == 0
    told = capsys.readouterr().out
    with h5py.File(path) as f:
        assert f.attrs["content_sha256"].decode()[:16] in told
    for word in (
        "storage:",
        "load model: 4 signals",
        "body body_1: 12 states; E symmetric and positive definite",
        "laws:",
    ):
        assert word in told
    assert re.search(r"1 K and 1 W kept to \d+e-1[5-9]", told)


def test_the_check_of_a_certificate_that_failed(tmp_path, capsys):
    write_artefact(tmp_path / "a.h5", MODEL, certificate={"passed": False, "step": 60.0})
    assert run(["info", "--check", str(tmp_path / "a.h5")]) == 1
    assert "errors above the limits of the machine" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("edit", "what"),
    [
        (put(A0, lambda a: -a), "body_0/A0' and 'A' let temperatures grow: a rate of "),
        (put("bodies/body_0/A", lambda a: -a), "body_0/A0' and 'A' let temperatures grow: a rate of "),
        (put(E, lambda e: 0.0 * e), "body_0/E' cannot be solved with"),
        (put("bodies/body_0/P_out", lambda p: 2.0 * p), "body_0/P' is not 1 K of a body that is 1 K warm"),
    ],
)
def test_an_oblique_projection_is_checked_too(tmp_path, edit, what):
    path = synthetic_run.artefact(tmp_path / "a.h5", synthetic.oblique(MODEL))
    assert read_artefact(path).model.bodies[0].symmetric is False
    with h5py.File(path, "r+") as f:
        edit(f)
        stamp(f)
    assert what in str(refusal(path))
