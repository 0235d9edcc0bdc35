"""First-order responses of elementary causes against differences of the exact model."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.faults.acted import slots_with
from twin.diagnose.faults.elements import FORCINGS, slim
from twin.diagnose.faults.fault import Unit
from twin.diagnose.faults.table import FAULTS, OF_KIND
from twin.diagnose.model.bank import Column, respond

pytestmark = pytest.mark.long

LITTLE = {"heat": 0.5, "film": 0.05, "joint": 2e-3, "contact": 5e-3, "capacity": 50.0, "group": 5e-3, "air": 0.02,
          "zone": 0.02, "source": 0.5, "group_film": 0.05, "start": 0.05, "signal": 0.01,
          "warm": 1e-4, "loss": 5e-3, "wear": 5e-3}  # fmt: skip


def history(key, elements, study):
    """Per run (n,) of a column."""
    column = elements.columns[elements.index[key]]
    n = [planned.run.drive.n_steps for planned in study.runs]
    return tuple(np.zeros(k) if h is None else h for h, k in zip(column.histories, n, strict=True))


KEYS = [
    ("heat", "housing", "always"),
    ("heat", "stator", "block 2"),
    ("heat", "bed", "spindle_current^2"),
    ("film", "slide", "always"),
    ("film", "housing", "block 1"),
    ("film", "nut", "x_speed^0.6"),
    ("group", "air", "always"),
    ("group_film", "moving", "x_speed^0.6"),
    ("zone", "moving", "always"),
    ("air", "shop", "block 3"),
    ("joint", "flange", "block 2"),
    ("contact", "x_screw", "block 2"),
    ("capacity", "housing", "always"),
    ("source", "front", "spindle_speed^2.67"),
    ("warm", "front", "always"),
    ("loss", "front", "block 1"),
    ("loss", "nut", "block 2"),
    ("wear", "front", "running-in over 2 h"),
    ("start", "", ""),  # the first of its kind
    ("signal", "", ""),
]


@pytest.mark.parametrize("key", KEYS, ids=".".join)
def test_against_differences(key):
    """On the machine whose laws read no temperature, where responses leave out nothing."""
    study, elements = small_case.study(linear=True), small_case.elements(linear=True)
    key = key if key[1] else next(other for other in elements.index if other[0] == key[0])
    kind, place, _ = key
    unit = Unit(OF_KIND[kind], place, elements.index[key], history(key, elements, study))
    x = np.zeros(len(study.probed.parameters))
    got = small_case.responses(linear=True)[:, elements.index[key]]
    parts = []
    for k in study.fitted:
        slots = slots_with(study, elements, [unit], k)
        h = LITTLE[kind]
        parts.append((study.outputs(k, x, slots, [h]) - study.outputs(k, x, slots, [-h])) / (2 * h))
    wanted = np.concatenate(parts)
    size = np.abs(wanted).max()
    assert size > 0.0
    # a contact's flow follows the state within a step, of which a response sees the mean
    most = 0.1 if kind == "contact" else 0.005
    assert np.abs(got - wanted).max() < most * size
    cosine = got @ wanted / np.sqrt((got @ got) * (wanted @ wanted))
    assert cosine > 1.0 - most / 10
    assert got @ wanted / (wanted @ wanted) == pytest.approx(1.0, abs=most)


def test_every_fault_in_a_machine_is_compared():
    """But those that a lumped machine has not, a coolant, which is a film and heat, and what `test_paths` compares."""
    acting = {fault.kind for fault in FAULTS.values() if not fault.read}
    assert acting - {"gradient", "moved", "coolant", "between"} == {kind for kind, _, _ in KEYS}


def test_reactions_of_laws_are_small():
    """Bearings that run easier when warm, and radiation."""
    study, elements = small_case.study(), small_case.elements()
    key = ("heat", "housing", "always")
    unit = Unit(OF_KIND["heat"], "housing", elements.index[key], history(key, elements, study))
    x = np.zeros(len(study.probed.parameters))
    slots = slots_with(study, elements, [unit], 0)
    exact = study.outputs(0, x, slots, [0.5]) - study.outputs(0, x, slots, [-0.5])
    error = np.abs(small_case.responses()[: len(exact), elements.index[key]] - exact).max()
    assert 1e-5 * np.abs(exact).max() < error < 0.05 * np.abs(exact).max()


def test_responses_add_up():
    """Blocks of an hour make the whole run: the integration is linear."""
    elements, D = small_case.elements(), small_case.responses()
    for kind, place in (("heat", "slide"), ("film", "bed")):
        whole = D[:, elements.index[kind, place, "always"]]
        summed = D[:, elements.block_of[kind, place]].sum(axis=1)
        np.testing.assert_allclose(summed, whole, atol=2e-5 * np.abs(whole).max())


def test_one_run_leaves_the_other_alone():
    study, elements = small_case.study(), small_case.elements()
    first = study.runs[0].size
    for b, (run, _, _) in enumerate(elements.histories.blocks):
        response = small_case.responses()[:, elements.index["heat", "housing", f"block {b}"]]
        other = response[first:] if run == 0 else response[:first]
        assert not other.any()
        assert response.any()


def test_many_columns_are_stepped_in_portions(monkeypatch):
    import twin.diagnose.model.bank as bank

    study, nominal, elements = small_case.study(), small_case.nominal(), small_case.elements()
    some = elements.columns[:7]
    whole = respond(study, nominal, elements.vectors, some)
    monkeypatch.setattr(bank, "AT_ONCE", 3)
    np.testing.assert_allclose(respond(study, nominal, elements.vectors, some), whole, atol=1e-6 * np.abs(whole).max())


def test_an_absent_history_leaves_zero():
    study, elements = small_case.study(), small_case.elements()
    found = respond(study, small_case.nominal(), elements.vectors, [Column(0, (None, None, None))])
    assert not found.any()


def test_slim_keeps_what_exact_refits_step():
    elements = small_case.elements()
    small = slim(elements)
    for (kind, _, _), c in small.index.items():
        v = elements.columns[c].vector
        if kind in FORCINGS:
            np.testing.assert_allclose(small.vectors[0][v], elements.vectors[0][v], rtol=1e-6)
    size = [sum(v.nbytes for of in e.vectors for v in of) for e in (elements, small)]
    assert size[1] < size[0]
