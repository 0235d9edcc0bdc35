"""Linear scales: signs, bars with known errors, independence of the screw, and what a description may say of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.support.descriptions import edited
from twin.build.check_meshes import check_meshes
from twin.build.coupled_direct import CoupledMachine, assemble_coupled
from twin.build.displacement_field import DisplacementField
from twin.build.elastic_ports import PortTable
from twin.build.encoder import EncoderTerms, linear_encoders
from twin.build.factorize import factorize
from twin.build.mesh import BodyMesh, load_body_meshes
from twin.build.springs import spring_system
from twin.build.structure import Structure, assemble_structure
from twin.errors import DescriptionError
from twin.machine.bodies import bodies_of
from twin.machine.description import Axis, Box, Contact, Encoder, Machine, Part, Support
from twin.machine.load import load_machine
from twin.machine.tcp import TcpSide

SLIDE = Path(__file__).parents[1] / "machines" / "slide" / "machine.toml"
POSITIONS = [-0.2, -0.113, 0.0, 0.05, 0.2]  # m
ALPHA = 12e-6  # 1/K of every part of the even machine
DT = 10.0  # K
SCALE = Encoder(kind="linear", scale="bed.y_min", reader="slide.y_min", fixed_at=-0.3, expansion=8e-6)


@cache
def meshes() -> tuple[BodyMesh, ...]:
    return load_body_meshes(load_machine(SLIDE))


def with_encoder(encoder: Encoder, even: bool = False, **axis: object) -> Machine:
    """The slide machine with a scale; even: of one expansion, on supports that do not hinder it."""
    machine = load_machine(SLIDE)
    update: dict[str, object] = {"axes": {"x": machine.axes["x"].model_copy(update={"encoder": encoder, **axis})}}
    if even:
        k = 1e8
        stiffness = {"foot_1": (k, k, k), "foot_2": (k, 0.0, k), "foot_3": (0.0, 0.0, k)}
        update["supports"] = {n: Support(surface=f"{n}.z_min", stiffness=s) for n, s in stiffness.items()}
        update["materials"] = {n: m.model_copy(update={"expansion": ALPHA}) for n, m in machine.materials.items()}
    return machine.model_copy(update=update)


@cache
def even(expansion: float) -> Structure:
    encoder = SCALE.model_copy(update={"expansion": expansion})
    return assemble_structure(with_encoder(encoder, even=True), meshes())


@cache
def scaled() -> Structure:
    return assemble_structure(with_encoder(SCALE), meshes())


@cache
def plain() -> Structure:
    return assemble_structure(with_encoder(Encoder()), meshes())


def uniform(dT: float = DT) -> list[np.ndarray]:
    return [np.full(b.n, dT) for b in meshes()]


def random_fields(seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.normal(size=b.n) + 20.0 * b.nodes @ rng.normal(size=3) for b in meshes()]


def only(body: int, part: str, dT: float) -> list[np.ndarray]:
    """One warm part."""
    fields = [np.zeros(b.n) for b in meshes()]
    mesh, offset = meshes()[body].part(part)
    fields[body][offset : offset + mesh.n] = dT
    return fields


@pytest.mark.parametrize("x", POSITIONS)
def test_machine_scale_and_workpiece_of_one_expansion_have_no_error(x: float) -> None:
    """E-004-6: the workpiece grows from the work patch; tool patch and tool point stand at the same x."""
    w = even(ALPHA).displacement({"x": x}, uniform())[0]
    system = even(ALPHA).system
    assert system.tool.centroid[0] == pytest.approx(system.tool_point[0], abs=1e-12)
    workpiece = ALPHA * DT * (system.tool_point[0] + x - system.work.centroid[0])
    assert abs(w - workpiece) <= 1e-9 * ALPHA * DT


@pytest.mark.parametrize("x", POSITIONS)
@pytest.mark.parametrize("expansion", [0.0, 8e-6])
def test_a_scale_of_less_expansion_than_the_machine(x: float, expansion: float) -> None:
    """Uniform heat, nothing strained: the reader stays where the scale has its mark, the tool keeps its distance to it.

    The marks are at fixed_at + (1 + alpha_s dT) (s - fixed_at); the fixing point goes with the bed.
    """
    system = even(expansion).system
    tool, work, reader = (p.centroid[0] for p in (system.tool, system.work, system.encoders[0].reader))
    fixed = SCALE.fixed_at
    mark = ALPHA * DT * fixed + expansion * DT * (reader + x - fixed)  # from the foot that is held, up to a constant
    expected = mark + ALPHA * DT * (tool - reader) - ALPHA * DT * work
    assert even(expansion).displacement({"x": x}, uniform())[0] == pytest.approx(expected, rel=1e-8, abs=1e-14)
    if expansion == 0.0:  # the position error relative to a steel workpiece grows by its expansion alone
        assert even(0.0).displacement({"x": x}, uniform())[0] == pytest.approx(
            even(0.0).displacement({"x": 0.0}, uniform())[0], abs=1e-14
        )


def test_rows_and_displacement_agree_with_the_direct_solve() -> None:
    coupled = assemble_coupled(with_encoder(SCALE), meshes())
    poses = np.array([[-0.17], [0.031], [0.2]])
    rows = scaled().pose_rows(poses)
    for i, pose in enumerate(poses):
        fields = random_fields(i)
        w = coupled.displacement(pose, fields)
        assert scaled().displacement(pose, fields) == pytest.approx(w, abs=1e-8 * np.linalg.norm(w))
        assert sum(G[i] @ T for G, T in zip(rows, fields, strict=True)) == pytest.approx(w, abs=1e-8 * abs(w).max())
        for G, direct in zip(rows, coupled.rows(pose), strict=True):
            assert abs(G[i] - direct).max() <= 1e-8 * max(abs(g).max() for g in coupled.rows(pose))


def solved_with_nuts_that_follow(coupled: CoupledMachine, pose: np.ndarray, fields: list[np.ndarray]) -> np.ndarray:
    """TCP displacement with every nut set so far along its screw that its axis' reader is at the mark: no formula."""
    system = coupled.system
    J = system.gap_rows(pose)
    nuts = [  # the axial springs of the axes with scales
        [i for i, n in enumerate(system.names) if n.startswith(f"contacts.{system.axes[e.axis]}_") and "axial" in n]
        for e in system.encoders
    ]
    assert all(len(n) == 1 for n in nuts)
    pushes = [-(coupled.U @ J[n].T @ system.stiffness[n]) for n in nuts]  # per metre of the nut's offset
    loads = np.column_stack([coupled.KT @ np.concatenate(fields), *pushes])
    ports = coupled.U.T @ factorize(coupled.stiffness(pose)).solve(loads)
    readers = np.array([system.reader_row(e, pose) for e in system.encoders]) @ ports
    growth = [system.scale_row(e, pose) @ fields[e.strip.body][e.strip.nodes] for e in system.encoders]
    offsets = np.linalg.solve(readers[:, 1:], growth - readers[:, 0])
    return system.nut_rows(pose) @ ports @ np.append(1.0, offsets)


@pytest.mark.parametrize("x", POSITIONS)
def test_the_shift_is_what_nuts_at_their_marks_give(x: float) -> None:
    coupled, pose = assemble_coupled(with_encoder(SCALE), meshes()), np.array([x])
    for seed in range(2):
        w = solved_with_nuts_that_follow(coupled, pose, random_fields(seed))
        assert scaled().displacement(pose, random_fields(seed)) == pytest.approx(w, abs=1e-8 * np.linalg.norm(w))


@pytest.mark.slow
def test_three_scales_of_the_five_axis_machine_are_what_nuts_at_their_marks_give() -> None:
    """X carries Y and the tool, Z the work: shifts of nested axes add, and the work side's has the other sign."""
    machine = load_machine(SLIDE.parents[3] / "models/five_axis/machine.toml")
    sides = {"x": ("x_rail_1.top", "column.pad_2"), "y": ("y_rail_1.top", "headstock.pad_2"),
             "z": ("z_rail_1.top", "carriage.pad_2")}  # fmt: skip
    bodies = load_body_meshes(machine)
    axes = {}
    for name, (scale, reader) in sides.items():
        part, _ = next(b for b in bodies if any(p.name == scale.split(".")[0] for p in b.parts)).part(
            scale.split(".")[0]
        )
        fixed_at = float(part.nodes[:, "xyz".index(name)].mean()) - 0.1
        encoder = Encoder(kind="linear", scale=scale, reader=reader, fixed_at=fixed_at, expansion=9e-6)
        axes[name] = machine.axes[name].model_copy(update={"encoder": encoder})
    machine = machine.model_copy(update={"axes": machine.axes | axes})
    structure, coupled = assemble_structure(machine, bodies), assemble_coupled(machine, bodies)
    rng = np.random.default_rng(5)
    for pose in rng.uniform(-0.35, 0.35, (3, 3)):
        fields = [rng.normal(size=b.n) + 10.0 * b.nodes @ rng.normal(size=3) for b in bodies]
        w = solved_with_nuts_that_follow(coupled, pose, fields)
        assert structure.displacement(pose, fields) == pytest.approx(w, abs=1e-7 * np.linalg.norm(w))
        for axis in "xyz":
            assert structure.encoder_terms(axis, pose, fields).scale != 0.0


@cache
def work_side() -> Structure:
    """The workpiece on the slide, the tool on the bed."""
    machine = with_encoder(SCALE, even=True)
    tcp = machine.tcp.model_copy(
        update={"tool": TcpSide(surface="bed.y_max", point=(0.0, 0.15, 0.28)), "work": TcpSide(surface="plate.z_max")}
    )
    return assemble_structure(machine.model_copy(update={"tcp": tcp}), meshes())


@pytest.mark.parametrize("x", POSITIONS)
def test_an_axis_that_carries_the_work_has_the_other_sign(x: float) -> None:
    """E-004-6: the scale's term is then minus its growth."""
    tool_side = even(8e-6).encoder_terms("x", {"x": x}, uniform())
    terms = work_side().encoder_terms("x", {"x": x}, uniform())
    assert terms.scale == pytest.approx(-8e-6 * DT * (x + 0.3), rel=1e-9)
    assert terms.scale == pytest.approx(-tool_side.scale, rel=1e-9)
    assert terms.reader == pytest.approx(-tool_side.reader, rel=1e-8)
    assert terms.total == pytest.approx(work_side().displacement({"x": x}, uniform())[0], rel=1e-9)


def test_only_the_axis_of_the_scale_is_corrected() -> None:
    for seed, x in enumerate(POSITIONS):
        with_scale, without = (s.displacement({"x": x}, random_fields(seed)) for s in (scaled(), plain()))
        assert with_scale[1:] == pytest.approx(without[1:], abs=1e-15)
        assert abs(with_scale[0] - without[0]) > 1e-7


def test_a_warm_screw_does_not_move_the_tool() -> None:
    """Without a scale the nut takes the slide along: alpha dT times its distance from the bearing."""
    fields, x = only(0, "screw", 20.0), {"x": 0.2}
    grown = 11.5e-6 * 20.0 * (0.2 + 0.35)
    without, with_scale = plain().displacement(x, fields)[0], scaled().displacement(x, fields)[0]
    assert without == pytest.approx(grown, rel=0.03)
    # what is left: the block is glued to the screw's end and bends the bed a little
    assert abs(with_scale) <= 0.004 * grown
    tcp, reader = scaled().encoder_terms("x", x, fields).tcp, scaled().encoder_terms("x", x, fields).reader
    assert tcp == pytest.approx(without, rel=1e-9)
    assert reader == pytest.approx(-grown, rel=0.03)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_warm_bracket_of_the_reader_counts_by_its_mounting_side(side: float) -> None:
    """A bracket grows away from the slide and takes the reader along; the control moves the slide back."""
    length, thick, dT = 0.08, 0.02, 15.0
    machine = with_encoder(SCALE.model_copy(update={"reader": f"bracket.x_{'max' if side > 0 else 'min'}"}))
    origin = (0.12 if side > 0 else -0.12 - length, -0.14, 0.165)
    bracket = Part(material="steel", box=Box(origin=origin, size=(length, thick, thick), divisions=(3, 1, 1)))
    glued = Contact(
        kind="fixed",
        surfaces=("slide.x_max", "bracket.x_min") if side > 0 else ("slide.x_min", "bracket.x_max"),
        conductance=3000.0,
    )
    axis = machine.axes["x"].model_copy(update={"stroke": (-0.15, 0.15)})
    machine = machine.model_copy(
        update={
            "parts": machine.parts | {"bracket": bracket},
            "contacts": machine.contacts | {"bracket": glued},
            "axes": {"x": axis},
        }
    )
    bodies = load_body_meshes(machine)
    structure = assemble_structure(machine, bodies)
    fields = [np.zeros(b.n) for b in bodies]
    mesh, offset = bodies[1].part("bracket")
    fields[1][offset : offset + mesh.n] = dT
    grown = 11.5e-6 * dT * length
    w = structure.displacement({"x": 0.1}, fields)[0]
    assert w == pytest.approx(-side * grown, rel=0.06)  # the glued end is not free to grow sideways
    terms = structure.encoder_terms("x", {"x": 0.1}, fields)
    assert terms.reader == pytest.approx(-side * grown, rel=0.06)
    assert terms.scale == 0.0
    assert abs(terms.tcp) <= 0.05 * grown


def test_terms_add_up_to_the_displacement() -> None:
    """Paper 004, eq (27): 13 um of the TCP and 5 um of the reader, none of the scale, are 18 um."""
    assert EncoderTerms(13e-6, 5e-6, 0.0).total == pytest.approx(18e-6, rel=1e-15)
    assert str(EncoderTerms(13e-6, 5e-6, 0.0)) == "+18.00 um (tcp +13.00, reader +5.00, scale +0.00)"
    for seed, x in enumerate(POSITIONS):
        fields = random_fields(seed)
        terms = scaled().encoder_terms("x", {"x": x}, fields)
        w = scaled().displacement({"x": x}, fields)
        assert terms.total == pytest.approx(w[0], abs=1e-9 * np.linalg.norm(w))
        assert min(abs(terms.reader), abs(terms.scale)) > 1e-7
        rotary = plain().encoder_terms("x", {"x": x}, fields)
        assert (rotary.reader, rotary.scale) == (0.0, 0.0)
        assert rotary.tcp == pytest.approx(plain().displacement({"x": x}, fields)[0], abs=1e-9 * np.linalg.norm(w))
    with pytest.raises(ValueError, match="no linear axis 'y'"):
        scaled().encoder_terms("y", {"x": 0.0}, fields)


@pytest.mark.parametrize("x", POSITIONS)
def test_terms_of_uniform_heat(x: float) -> None:
    system = even(8e-6).system
    reader = system.encoders[0].reader.centroid[0]
    terms = even(8e-6).encoder_terms("x", {"x": x}, uniform())
    assert terms.reader == pytest.approx(-ALPHA * DT * (reader + x - SCALE.fixed_at), rel=1e-8)
    assert terms.scale == pytest.approx(8e-6 * DT * (reader + x - SCALE.fixed_at), rel=1e-10)


@pytest.mark.parametrize("x", [-0.2, 0.05])
def test_a_scale_on_the_slide_and_a_reader_on_the_bed(x: float) -> None:
    """By symmetry; the slide is only 0.24 m long, so the scale lies on a ruler that it carries."""
    machine = with_encoder(
        Encoder(kind="linear", scale="ruler.y_min", reader="lug.y_max", fixed_at=-0.35, expansion=8e-6), even=True
    )
    boxes = {
        "ruler": Box(origin=(-0.35, -0.17, 0.16), size=(0.7, 0.03, 0.03), divisions=(9, 1, 1)),
        "lug": Box(origin=(0.0, -0.20, 0.1), size=(0.04, 0.03, 0.09), divisions=(1, 1, 3)),
        "shelf": Box(origin=(0.0, -0.20, 0.07), size=(0.04, 0.05, 0.03), divisions=(1, 2, 1)),
    }
    parts = {n: Part(material="steel", box=box) for n, box in boxes.items()}
    glue = {
        "ruler": ("slide.y_min", "ruler.y_max"),
        "shelf": ("bed.y_min", "shelf.y_max"),
        "lug": ("shelf.z_max", "lug.z_min"),
    }
    contacts = {n: Contact(kind="fixed", surfaces=s, conductance=3000.0) for n, s in glue.items()}
    machine = machine.model_copy(update={"parts": machine.parts | parts, "contacts": machine.contacts | contacts})
    bodies = load_body_meshes(machine)
    structure = assemble_structure(machine, bodies)
    encoder = structure.system.encoders[0]
    assert encoder.sign == 1.0
    reader = encoder.reader.centroid[0]
    fields = [np.full(b.n, DT) for b in bodies]
    at = reader - x  # the mark under the reader, on the ruler
    assert encoder.facing(np.array([-x, 0.0, 0.0])) == pytest.approx(at, abs=1e-12)
    # the slide stands so that its mark, on ruler coordinates fixed + (1 + alpha_s dT) (at - fixed), is at the reader
    terms = structure.encoder_terms("x", {"x": x}, fields)
    assert terms.scale == pytest.approx(-8e-6 * DT * (at + 0.35), rel=1e-9)
    work, tool = structure.system.work.centroid[0], structure.system.tool.centroid[0]
    slide_origin = ALPHA * DT * reader - (ALPHA * DT * -0.35 + 8e-6 * DT * (at + 0.35))
    expected = slide_origin + ALPHA * DT * tool - ALPHA * DT * work
    assert structure.displacement({"x": x}, fields)[0] == pytest.approx(expected, rel=1e-8)
    same = encoder_of(structure, ALPHA)  # one expansion: no error against a workpiece of the same
    w = same.displacement({"x": x}, fields)[0]
    assert w == pytest.approx(ALPHA * DT * (x + tool - work), rel=1e-8)


def encoder_of(structure: Structure, expansion: float) -> Structure:
    encoders = tuple(replace(e, expansion=expansion) for e in structure.system.encoders)
    return replace(structure, system=replace(structure.system, encoders=encoders))


def test_a_common_rigid_motion_is_not_read() -> None:
    """Rotation included: the reader's tilt is carried to the scale's line, where the scale is."""
    system = scaled().system
    U = [p.toarray() for p in port_matrices(with_encoder(SCALE))]
    t, w = np.array([1e-3, 2e-3, -1e-3]), np.array([1e-3, -2e-3, 3e-3])
    for x in POSITIONS:
        u = [(t + np.cross(w, b.nodes + [s, 0.0, 0.0])).ravel() for s, b in zip((0.0, x), meshes(), strict=True)]
        ports = np.concatenate([m.T @ v for m, v in zip(U, u, strict=True)])
        assert abs(system.reader_row(system.encoders[0], {"x": x}) @ ports) <= 1e-12
        assert abs(system.tcp_rows({"x": x}) @ ports).max() <= 1e-12


def port_matrices(machine: Machine):
    ports = PortTable(meshes())
    spring_system(machine, bodies_of(machine), ports)
    return ports.matrices()


def test_the_integral_converges_and_is_exact_for_whole_slices() -> None:
    """int T ds along the scale of T = sin(3 s): 24 slices err by less than the mesh's own interpolation does."""
    bed = meshes()[0]
    T = np.sin(3.0 * bed.nodes[:, 0])
    shifts, ends = scaled().system.shifts, np.linspace(-0.3, 0.3, 23)
    exact = np.array([np.cos(3.0 * -0.3) - np.cos(3.0 * e) for e in ends]) / 3.0

    def integrals(slices: int) -> np.ndarray:
        (encoder,) = linear_encoders(with_encoder(SCALE), PortTable(meshes()), shifts, slices)
        return np.array([encoder.strip.integral(-0.3, e) @ T[encoder.strip.nodes] for e in ends])

    coarse, fine, finest = integrals(4), integrals(24), integrals(96)
    assert abs(fine - finest).max() < abs(coarse - finest).max() / 100.0
    assert abs(fine - finest).max() < abs(finest - exact).max()
    assert abs(fine - exact).max() < 1e-5  # of 0.5 m K: 0.08 nm at 8e-6 1/K
    (encoder,) = scaled().system.encoders
    row = encoder.strip.integral(0.1, -0.25)
    assert row.sum() == pytest.approx(-0.35, rel=1e-12)
    assert encoder.strip.integral(-0.25, 0.1) == pytest.approx(-row)
    linear = bed.nodes[encoder.strip.nodes] @ [2.0, -3.0, 0.5]  # the scale's line: y = -0.15, z = 0.05
    assert row @ linear == pytest.approx(-0.35 * (0.45 + 0.025) + (0.25**2 - 0.1**2), rel=1e-10)
    assert encoder.strip.integral(0.35, 0.45) @ linear == pytest.approx(0.1 * 0.475 + 0.45**2 - 0.35**2, rel=1e-10)


def test_the_field_of_displacements_holds_the_shift_too() -> None:
    machine, fields = with_encoder(SCALE), random_fields(3)
    field, bare = (
        DisplacementField(m, meshes(), s)({"x": 0.07}, fields)
        for m, s in ((machine, scaled()), (with_encoder(Encoder()), plain()))
    )
    moved = scaled().displacement({"x": 0.07}, fields) - plain().displacement({"x": 0.07}, fields)
    assert abs(field[0] - bare[0]).max() <= 1e-9 * abs(bare[0]).max()
    assert abs(field[1] - bare[1] - moved).max() <= 1e-8 * abs(bare[1]).max()


def test_a_scale_shorter_than_the_stroke_is_refused() -> None:
    machine = with_encoder(SCALE, stroke=(-0.2, 0.45))
    with pytest.raises(DescriptionError, match=r"at 0\.45 m the reader faces 0\.45 m along axis 'x'"):
        assemble_structure(machine, meshes())
    (problem,) = [p for p in check_meshes(machine).problems if "encoder" in p.where]
    assert "-0.4 .. 0.4 m has no scale" in problem.what


def test_a_fixing_point_beside_the_scale_is_refused() -> None:
    machine = with_encoder(SCALE.model_copy(update={"fixed_at": 0.5}))
    with pytest.raises(DescriptionError, match=r"fixed at 0\.5 m, but 'bed\.y_min' reaches from -0\.4 to 0\.4"):
        assemble_structure(machine, meshes())


def test_a_reader_far_from_its_scale_is_told() -> None:
    machine = with_encoder(SCALE.model_copy(update={"reader": "plate.z_max"}))
    (problem,) = check_meshes(machine).problems
    assert problem.warning
    assert "beside the scale's line" in problem.what
    near = with_encoder(SCALE.model_copy(update={"scale": "rail_1.y_min"}))
    assert check_meshes(near).problems == ()


LINEAR = "encoder = { kind = 'linear', scale = 'bed.y_min', reader = 'slide.y_min', expansion = '8e-6 1/K' }"


def problems_of(folder: Path, encoder: str, *edits: tuple[str, str]) -> list[str]:
    position = 'position = "x_position"\n'
    with pytest.raises(DescriptionError) as e:
        load_machine(edited(folder, (position, position + encoder + "\n"), *edits))
    return [str(p) for p in e.value.problems]


def test_a_sound_encoder_passes(tmp_path: Path) -> None:
    position = 'position = "x_position"\n'
    machine = load_machine(edited(tmp_path, (position, position + LINEAR + "\n")))
    assert machine.axes["x"].encoder.expansion == 8e-6


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        (("bed.y_min", "bad.y_min"), "axes.x.encoder.scale", "did you mean 'bed'?"),
        (("slide.y_min", "slide.y_mn"), "axes.x.encoder.reader", "did you mean 'y_min'?"),
        (("scale = 'bed.y_min', ", ""), "axes.x.encoder", "without 'scale'"),
        (("reader = 'slide.y_min', ", ""), "axes.x.encoder", "without 'reader'"),
        ((", expansion = '8e-6 1/K'", ""), "axes.x.encoder", "without 'expansion'"),
        (("kind = 'linear', ", ""), "axes.x.encoder.scale", "of a rotary encoder"),
        (("slide.y_min", "rail_1.y_min"), "axes.x.encoder", "both stand still"),
        (("bed.y_min", "plate.y_min"), "axes.x.encoder", "both move"),
        (("8e-6 1/K", "8 um/m"), "axes.x.encoder.expansion", "1/K"),
        (("kind = 'linear'", "kind = 'linaer'"), "axes.x.encoder.kind", "did you mean 'linear'?"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, change: tuple[str, str], where: str, what: str) -> None:
    found = problems_of(tmp_path, LINEAR.replace(*change))
    assert any(f"{where} (line" in p and what in p for p in found), found


def test_an_encoder_on_a_rotary_axis_is_refused(tmp_path: Path) -> None:
    axis = f"[axes.c]\nkind = 'rotary'\ndirection = [0, 0, 1]\ncarries = ['plate']\nposition = 'x_speed'\n{LINEAR}\n"
    with pytest.raises(DescriptionError, match="an encoder on a rotary axis"):
        load_machine(edited(tmp_path, ("[axes.x]", axis + "\n[axes.x]")))


def test_guides_that_hold_along_the_axis_are_refused(tmp_path: Path) -> None:
    guide = ('normal = "300 N/um", ', 'normal = "300 N/um", axial = "5 N/um", ')
    (problem,) = problems_of(tmp_path, LINEAR, guide)
    assert "contacts.x_guide.stiffness.axial" in problem
    assert "set axial = 0" in problem


def test_defaults_stay_those_of_a_rotary_encoder() -> None:
    assert Axis(direction=(1, 0, 0), carries=("slide",), position="x").encoder == Encoder(kind="rotary")
    assert plain().system.encoders == ()
