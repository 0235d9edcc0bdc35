"""What the cache can keep, and that reading an entry runs nothing of it."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from skfem import MeshTet2

from twin.build.cache_codec import decode, encode
from twin.build.full_model import SurfaceMesh, assemble
from twin.build.mesh import body_mesh, part_mesh
from twin.build.stored_model import restored, stored
from twin.machine.load import load_machine
from twin.rom.load_model import EnvironmentWiring, LawUse

PLAIN = st.none() | st.booleans() | st.integers() | st.floats() | st.text()
ARRAYS = hnp.arrays(
    st.one_of(
        hnp.floating_dtypes(), hnp.integer_dtypes(), hnp.unsigned_integer_dtypes(), hnp.boolean_dtypes(),
        hnp.complex_number_dtypes(), hnp.unicode_string_dtypes(),
    ),
    hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)  # fmt: skip
KEYS = st.text() | st.integers() | st.tuples(st.text(), st.booleans())
DATA = st.recursive(
    PLAIN | ARRAYS | ARRAYS.filter(lambda a: a.size).map(lambda a: a.flat[0]),
    lambda inner: (
        st.lists(inner)
        | st.lists(inner).map(tuple)
        | st.dictionaries(KEYS, inner)
        | st.builds(SurfaceMesh, inner, inner)
        | st.builds(LawUse, st.text(), st.dictionaries(st.text(), st.floats()), st.dictionaries(st.text(), inner))
    ),
    max_leaves=12,
)


def through(value):
    """As an entry: the structure through JSON text."""
    structure, arrays = encode(value)
    return decode(json.loads(json.dumps(structure)), arrays)


def equal(a, b) -> bool:
    """Of equal type and content all the way down; NaN equals NaN."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray | np.generic):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, float):
        return (a != a and b != b) or (a == b and np.signbit(a) == np.signbit(b))
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(equal, a, b))
    if isinstance(a, dict):
        return equal(list(a), list(b)) and equal(list(a.values()), list(b.values()))
    if sp.issparse(a):
        return a.shape == b.shape and all(equal(getattr(a, k), getattr(b, k)) for k in ("data", "indices", "indptr"))
    return equal(vars(a), vars(b)) if hasattr(a, "__dict__") else a == b


@given(DATA)
def test_data_come_back_as_they_were(value):
    assert equal(through(value), value)


@pytest.mark.parametrize("kind", [sp.csr_array, sp.csc_array, sp.csr_matrix, sp.csc_matrix])
@pytest.mark.parametrize("index", [np.int32, np.int64])
def test_sparse_matrices_keep_their_class_and_the_width_of_their_indices(kind, index):
    matrix = kind(sp.random_array((7, 5), density=0.3, rng=np.random.default_rng(0)))
    matrix.indices, matrix.indptr = matrix.indices.astype(index), matrix.indptr.astype(index)
    again = through(matrix)
    assert equal(again, matrix)
    assert np.array_equal(again @ np.ones(5), matrix @ np.ones(5))


def test_what_is_met_twice_is_one_object_again():
    array, wiring = np.arange(3.0), EnvironmentWiring("shop", "air", 20.0)
    first, second, (a, b, c) = through((wiring, [wiring], (array, array, array.copy())))
    assert first is second[0]
    assert a is b is not c


@pytest.mark.parametrize(
    "value",
    [lambda: 0, Path("a"), Fraction(1, 2), {1, 2}, np.array([{}]), SurfaceMesh, slice(3), sp.coo_array(np.eye(2)), 1j],
)
def test_what_is_no_data_is_not_kept(value):
    with pytest.raises(TypeError, match="no data that the cache keeps"):
        encode([value])


@pytest.mark.parametrize(
    "name",
    [
        "subprocess:Popen", "fractions:Fraction", "skfem.mesh.mesh:Mesh", "twinned.module:Class", ":Class",
        "twin.build.full_model:MachineModel",  # a dataclass of another module
        "twin.build.workers:each", "twin.build.workers:subprocess", "twin.build.structure:Structure.rows",
        "twin.units:to_si", "twin.errors:TwinError", "twin.no.such:Module",
    ],
)  # fmt: skip
def test_an_entry_that_names_anything_but_a_dataclass_of_this_package_is_refused(name):
    with pytest.raises((TypeError, ImportError, AttributeError)):
        decode({"root": {"object": 0}, "objects": [[name, ["true", ["touch"]]]]}, [])


def test_a_class_outside_is_refused_before_its_module_is_imported(tmp_path, monkeypatch):
    (tmp_path / "planted.py").write_text("raise SystemExit('the entry ran code')\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(TypeError, match="no class of this package"):
        decode({"root": None, "objects": [["planted:Class", []]]}, [])


def test_a_dataclass_with_other_fields_is_refused():
    structure, arrays = encode(SurfaceMesh(np.zeros(1), np.zeros(1)))
    structure["objects"][0][1].append(1.0)
    with pytest.raises(ValueError, match="longer"):
        decode(structure, arrays)


def test_sparse_indices_that_point_outside_are_refused():
    structure, arrays = encode(sp.csr_array(np.eye(3)))
    arrays[1] = arrays[1] + 1_000_000
    with pytest.raises(ValueError, match="indices"):
        decode(structure, arrays)


def test_meshes_are_numbered_as_before(two_part_model):
    again = restored(through(stored(two_part_model)))
    assert again.bodies
    for body, other in zip(two_part_model.bodies, again.bodies, strict=True):
        assert body.offsets == other.offsets
        for part, same in zip(body.parts, other.parts, strict=True):
            assert type(part.mesh) is type(same.mesh)
            for name in ("p", "t", "doflocs", "facets", "edges", "t2f", "f2t", "t2e"):
                assert np.array_equal(getattr(part.mesh, name), getattr(same.mesh, name)), name
            assert np.array_equal(part.elements, same.elements)
            assert equal(dict(part.surfaces), same.surfaces)
            assert np.array_equal(part.nodes, same.nodes)


@pytest.fixture(params=["straight", "curved"])
def two_part_model(request):
    """The full model of the small machine, whose first part is curved or straight."""
    full = assemble(load_machine(Path(__file__).parents[1] / "machines" / "slide"))
    if request.param == "straight":
        return full
    first, *others = full.bodies
    part = first.parts[0]
    mesh = MeshTet2.from_mesh(part.mesh)
    points = mesh.doflocs + 1e-4 * np.sin(40.0 * mesh.doflocs[::-1])
    curved = part_mesh(part.name, MeshTet2(points, mesh.t), part.surfaces)
    return replace(full, bodies=(body_mesh(first.name, (curved, *first.parts[1:])), *others))
