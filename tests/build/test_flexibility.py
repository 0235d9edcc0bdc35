"""Bodies of glued solids and their condensation to elastic ports."""

from __future__ import annotations

import numpy as np
import pytest

from tests.build.parts import STEEL, box, stacked
from twin.build.elastic_ports import PortTable, rigid_modes
from twin.build.elasticity import body_elasticity
from twin.build.factorize import factorize
from twin.build.flexibility import SupportedBody, condense, isostatic_supports
from twin.build.mesh import BodyMesh, body_mesh
from twin.errors import DescriptionError
from twin.machine.description import Contact, Machine, Material, Part


def glued(a: Material = STEEL, b: Material = STEEL) -> Machine:
    """The description of parts a and b, b on a; only what elasticity reads."""
    joint = Contact(kind="fixed", surfaces=("a.z_max", "b.z_min"), conductance=1000.0)
    return Machine.model_construct(
        materials={"a": a, "b": b}, parts={n: Part(material=n) for n in "ab"}, contacts={"joint": joint}
    )


NON_MATCHING = stacked((3, 2, 1), (2, 3, 2))


def test_glue_across_non_matching_meshes_lets_rigid_motion_pass() -> None:
    body = body_elasticity(glued(), NON_MATCHING)
    assert abs(body.K @ rigid_modes(NON_MATCHING.nodes)).max() <= 1e-12 * abs(body.K).max()
    loose = body_elasticity(glued().model_copy(update={"contacts": {}}), NON_MATCHING)
    apart = np.zeros((NON_MATCHING.n, 3))
    apart[NON_MATCHING.offsets[1] :, 0] = 1.0
    assert abs(loose.K @ apart.ravel()).max() <= 1e-12 * abs(loose.K).max()
    assert abs(body.K @ apart.ravel()).max() > 1e-3 * abs(body.K).max()


def test_uniform_expansion_is_exact_across_non_matching_meshes() -> None:
    body, x = body_elasticity(glued(), NON_MATCHING), NON_MATCHING.nodes
    u = SupportedBody(body, x).solve(body.KT @ np.full((len(x), 1), 10.0))[:, 0]
    free = STEEL.expansion * 10.0 * x.ravel()
    modes = rigid_modes(x)
    rigid = np.linalg.lstsq(modes, u - free, rcond=None)[0]
    assert abs(u - free - modes @ rigid).max() <= 1e-10 * abs(free).max()


def test_bimetal_strip_bends_as_timoshenko_says() -> None:
    """Timoshenko, Analysis of bi-metal thermostats, J. Opt. Soc. Am. 11, 1925, eq (4)."""
    nu = 0.0  # no anticlastic bending: the beam theory is then that of the slender solid
    low = Material(conductivity=1, density=1, heat_capacity=1, youngs_modulus=200e9, poisson_ratio=nu, expansion=12e-6)
    high = low.model_copy(update={"youngs_modulus": 70e9, "expansion": 23e-6})
    h_a, h_b, length = 0.01, 0.015, 0.6
    strip = body_mesh(
        "a",
        (
            box("a", (0, 0, 0), (length, 0.02, h_a), (24, 1, 2)),
            box("b", (0, 0, h_a), (length, 0.02, h_b), (20, 1, 2)),
        ),
    )
    body = body_elasticity(glued(low, high), strip)
    u = SupportedBody(body, strip.nodes).solve(body.KT @ np.full((strip.n, 1), 30.0)).reshape(-1, 3)
    m, n = h_a / h_b, low.youngs_modulus / high.youngs_modulus
    expected = 6 * (high.expansion - low.expansion) * 30.0 * (1 + m) ** 2
    expected /= (h_a + h_b) * (3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n)))
    x, y, z = strip.nodes.T
    middle = (z == 0) & (y == 0) & (abs(x - length / 2) < 0.3 * length)
    curvature = 2 * np.polyfit(x[middle], u[middle, 2], 2)[0]
    assert curvature == pytest.approx(-expected, rel=0.01)  # the side that expands more is convex


def test_joint_with_a_gap_is_refused() -> None:
    a, b = box("a", (0, 0, 0), (1, 1, 0.2), (4, 4, 1)), box("b", (0, 0, 0.201), (1, 1, 0.2), (4, 4, 1))
    lifted = body_mesh("a", (a, b))
    with pytest.raises(DescriptionError, match=r"0\.001 m apart"):
        body_elasticity(glued(), lifted)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_isostatic_supports_stop_rigid_motion_only(turn: float) -> None:
    c, s = np.cos(turn), np.sin(turn)
    points = NON_MATCHING.nodes @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) + [5.0, 0.0, 0.0]
    held = isostatic_supports(points)
    assert len(set(held)) == 6
    assert np.linalg.svd(rigid_modes(points - points.mean(axis=0))[held], compute_uv=False)[-1] > 0.3


def port_table(mesh: BodyMesh = NON_MATCHING) -> PortTable:
    ports = PortTable((mesh,))
    ports.rail("b.z_max", np.array([1.0, 0.0, 0.0]), 5)
    ports.rigid("a.x_min")
    ports.mean("a.z_min")
    return ports


def test_ports_read_rigid_motion_exactly_and_their_forces_have_the_right_resultant() -> None:
    ports = port_table()
    (U,) = ports.matrices()
    rail, rigid = ports.rail("b.z_max", np.array([1.0, 0.0, 0.0]), 5), ports.rigid("a.x_min")
    t, w = np.array([1e-3, -2e-3, 3e-3]), np.array([0.4, 0.5, -0.6])
    u = U.T @ (t + np.cross(w, NON_MATCHING.nodes)).ravel()
    for i, centroid in enumerate(rail.centroids):
        assert u[3 * i : 3 * i + 3] == pytest.approx(t + np.cross(w, centroid), abs=1e-14)
    assert rail.stations == pytest.approx([0.1, 0.3, 0.5, 0.7, 0.9])
    assert u[rigid.first + 3 : rigid.first + 6] == pytest.approx(w, abs=1e-14)
    point = np.array([7.0, -8.0, 9.0])
    assert rigid.motion_at(point) @ u[rigid.first : rigid.first + 6] == pytest.approx(t + np.cross(w, point), abs=1e-13)
    resultant = rigid_modes(NON_MATCHING.nodes).T @ U  # (6, p): force and moment about the origin of each port force
    assert resultant[3:, rigid.first + 3 : rigid.first + 6] == pytest.approx(np.eye(3), abs=1e-13)
    assert resultant[:3, rigid.first + 3 : rigid.first + 6] == pytest.approx(np.zeros((3, 3)), abs=1e-13)
    assert resultant[:3, :3] == pytest.approx(np.eye(3), abs=1e-14)


def test_flexibility_is_what_the_body_does() -> None:
    """... under port forces in equilibrium and heat, against a solve with the body held elsewhere."""
    body = body_elasticity(glued(), NON_MATCHING)
    ports = port_table()
    (U,) = ports.matrices()
    condensed = condense("a", tuple(ports.names[0]), U, body, NON_MATCHING.nodes)
    rng = np.random.default_rng(3)
    T, p = rng.normal(size=NON_MATCHING.n), rng.normal(size=U.shape[1]) * 1e6
    p -= np.linalg.pinv(condensed.R.T) @ (condensed.R.T @ p)  # no resultant
    at = [int(np.argmin(abs(NON_MATCHING.nodes - corner).sum(axis=1))) for corner in ([0, 0, 0], [1, 0, 0], [0, 1, 0])]
    held = np.array([3 * at[0], 3 * at[0] + 1, 3 * at[0] + 2, 3 * at[1] + 1, 3 * at[1] + 2, 3 * at[2] + 2])
    free = np.setdiff1d(np.arange(3 * NON_MATCHING.n), held)
    u = np.zeros(3 * NON_MATCHING.n)
    u[free] = factorize(body.K[free][:, free]).solve((body.KT @ T + U @ p)[free])
    difference = U.T @ u - condensed.H @ T - condensed.F @ p
    a = np.linalg.lstsq(condensed.R, difference, rcond=None)[0]
    assert abs(difference - condensed.R @ a).max() <= 1e-9 * abs(U.T @ u).max()
    assert np.linalg.eigvalsh(condensed.F)[0] > -1e-9 * np.linalg.eigvalsh(condensed.F)[-1]
