"""A model is the same as its copy, and no other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.build.two_bodies import model
from twin.build.same_model import same_model
from twin.rom.artefact import read_artefact, write_artefact


def test_a_model_is_the_one_that_its_artefact_holds(tmp_path: Path):
    written = model()
    write_artefact(tmp_path / "a.h5", written, "")
    assert same_model(written, read_artefact(tmp_path / "a.h5").model)


@pytest.mark.parametrize("field", ["E", "A0", "M", "P", "C", "G", "one", "energy"])
def test_a_last_bit_makes_another_model(field: str):
    mine = model()
    values = getattr(mine.bodies[1], field).copy()
    values.flat[-1] = np.nextafter(values.flat[-1], np.inf)
    body = replace(mine.bodies[1], **{field: values})
    assert not same_model(mine, replace(mine, bodies=(mine.bodies[0], body)))


def test_other_loads_make_another_model():
    mine = model()
    films = mine.load_model.films
    other = (replace(films[0], gain=1.01 * films[0].gain), *films[1:])
    assert not same_model(mine, replace(mine, load_model=replace(mine.load_model, films=other)))
    assert not same_model(mine, replace(mine, bodies=mine.bodies[:1]))


def test_rows_for_pictures_do_not_count():
    mine = model()
    bodies = tuple(replace(b, F=np.ones((2, b.n))) for b in mine.bodies)
    assert same_model(mine, replace(mine, bodies=bodies))
