"""A film on what fixed contacts leave free of a surface: its area, its matrix, and what names too much."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twin.build.mesh import load_body_meshes
from twin.build.surface import mass
from twin.build.thermal import assemble_thermal
from twin.errors import TwinError
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.show.surface import named_surfaces

SLIDE = load_machine(Path(__file__).parents[1] / "machines" / "slide")
# of bed.z_max, 0.8 x 0.3 m: two rails of 0.8 x 0.03 m, and the screw's block of 0.05 x 0.06 m
FREE = 0.24 - 2 * 0.024 - 0.003


def naming(*surfaces: str, **changes: object) -> Machine:
    film = SLIDE.films["structure"]
    film = film.model_copy(update={"surfaces": (*film.surfaces, *surfaces), **changes})
    return SLIDE.model_copy(update={"films": {**SLIDE.films, "structure": film}})


def term(machine: Machine) -> np.ndarray:
    """Matrix of the film on the bed."""
    model = assemble_thermal(machine, load_body_meshes(machine))
    bed, k = model.bodies[0], [f.name for f in model.load_model.films].index("structure")
    return bed.A[bed.theta.index(k)].toarray()


def test_it_acts_on_what_is_free_and_nowhere_else():
    added = term(naming("bed.z_max")) - term(SLIDE)
    one = np.ones(len(added))
    assert one @ added @ one == pytest.approx(FREE, rel=1e-12)
    eigenvalues = np.linalg.eigvalsh(added)
    assert eigenvalues[0] > -1e-15 * eigenvalues[-1] * len(added)
    bed = load_body_meshes(SLIDE)[0]
    part, offset = bed.part("bed")
    x = bed.nodes
    under = (np.abs(x[:, 1] + 0.1) < 0.0) | (np.abs(added).sum(axis=1) > 0)
    assert np.allclose(x[under][:, 2], 0.1)
    # linear fields over the free area: int y^2 dA of the whole minus that of rails and block
    own = slice(offset, offset + part.n)
    y = part.nodes[:, 1]
    whole = y @ mass(part, part.facets("z_max")) @ y
    rails = sum(0.8 * ((a + 0.03) ** 3 - a**3) / 3 for a in (-0.115, 0.085))
    assert y @ added[own, own] @ y == pytest.approx(whole - rails - 0.05 * 2 * 0.03**3 / 3, rel=1e-9)


def test_an_additional_film_acts_on_all_of_it():
    model = assemble_thermal(SLIDE, load_body_meshes(SLIDE))
    film = SLIDE.films["structure"].model_copy(update={"surfaces": ("bed.z_max",), "additional": True})
    with_it = SLIDE.model_copy(update={"films": {**SLIDE.films, "draught": film}})
    more = assemble_thermal(with_it, load_body_meshes(with_it))
    bed, k = more.bodies[0], [f.name for f in more.load_model.films].index("draught")
    assert bed.A[bed.theta.index(k)].sum() == pytest.approx(0.24)
    assert len(model.bodies[0].theta) + 1 == len(bed.theta)


def test_a_surface_without_a_free_part_is_refused():
    with pytest.raises(TwinError, match="leave nothing of 'rail_1"):
        assemble_thermal(naming("rail_1.z_min"), load_body_meshes(SLIDE))


def test_the_page_of_a_description_tells_it():
    machine = naming("bed.z_max")
    (bed,) = (s for s in named_surfaces(machine).named if s.path == "bed.z_max")
    assert (bed.film, bed.uncovered) == ("structure", 0.0)
    assert bed.of_film == pytest.approx(FREE)
    (before,) = (s for s in named_surfaces(SLIDE).named if s.path == "bed.z_max")
    assert before.uncovered == pytest.approx(FREE)
