"""The TCP beyond the pose grid, and structures that are damaged."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from twin.errors import ArtefactError
from twin.rom.artefact import read_artefact
from twin.rom.content import stamp
from twin.rom.tcp import by_body, tcp_at, tcp_over, tcp_rows


def test_positions_off_the_rail_have_the_tcp_of_the_grid_s_border(slide_artefact):
    """At 900 mm no pad is on its rail: extrapolated, the slide would move freely."""
    model = read_artefact(slide_artefact).model
    states = by_body(model, np.random.default_rng(0).standard_normal((2, sum(b.n for b in model.bodies))))
    beyond, border = np.array([[0.9], [-0.25]]), np.array([[0.2], [-0.2]])
    assert np.array_equal(tcp_at(model, states, beyond), tcp_at(model, states, border))
    assert np.array_equal(tcp_over(model, states, beyond), tcp_over(model, states, border))
    for own, wanted in zip(tcp_rows(model, beyond), tcp_rows(model, border), strict=True):
        assert np.array_equal(own, wanted)


def edited(change: Callable[[dict[str, Any]], object]) -> Callable[[h5py.File], None]:
    """A change of the structure's JSON."""

    def made(f: h5py.File) -> None:
        told = json.loads(f["structure/json"].asstr()[()])
        change(told)
        f["structure/json"][()] = json.dumps(told)

    return made


def put_nan(f: h5py.File) -> None:
    f["structure/bodies/bed/R"][0, 0] = np.nan


DAMAGE: dict[str, Callable[[h5py.File], None]] = {
    "not finite": put_nan,
    "negative stiffness": edited(lambda d: d["system"]["stiffness"]["values"].__setitem__(0, -1.0)),
    "no stiffness": edited(lambda d: d["system"]["stiffness"]["values"].__setitem__(0, float("nan"))),
    "a guide less": edited(lambda d: d["system"]["guides"].__delitem__(0)),
    "a body that is not there": edited(lambda d: d["system"]["tool"].__setitem__("body", 7)),
    "another stiffness": edited(lambda d: d["system"]["stiffness"]["values"].__setitem__(0, 1.0)),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_structure_is_refused(slide_artefact, tmp_path: Path, damage: str):
    path = Path(shutil.copy(slide_artefact, tmp_path / "a.h5"))
    with h5py.File(path, "r+") as f:
        DAMAGE[damage](f)
        stamp(f)
    with pytest.raises(ArtefactError, match=r"structure") as refused:
        read_artefact(path)
    assert "a.h5" in str(refused.value)
