"""The sixteen parts of the machine [m].

Machine coordinates with every axis at position zero: X to the right of the operator, Y up (floor at y = 0), Z along
the spindle from the column to the operator. The column travels in X on the bed, the headstock in Y on the column, the
carriage with swivel and table in Z on the bed; strokes are -0.4 .. 0.4 m, so the tool meets the table at z = -0.4 m.
Contact faces are planar polygons and the same on both sides at any mesh size.
"""

from __future__ import annotations

from itertools import pairwise

from csg import AXES, Patch, Solid, Span, along, around, block, disc, octagon, profile, rectangle, region

RAIL_WIDTH, RAIL_HEIGHT, PAD_HEIGHT, PAD_LENGTH = 0.06, 0.04, 0.03, 0.16
SCREW = 0.04  # side of the square bar that stands for the screw
NUT_LENGTH, NUT_DEPTH = 0.12, 0.05
MOTOR = 0.20  # width of a motor flange

X_TOP, Z_TOP = 0.45, 0.35  # height of the bed under the X and the Z rails
X_RAILS, X_PADS, X_SPAN = (-0.88, -0.42), (-0.33, 0.33), (-0.84, 0.84)  # rails' z, pads' x, rails from .. to
X_SCREW_Y, X_SCREW_Z, X_SCREW_SPAN = X_TOP + 0.025, -0.65, (-0.80, 0.86)

COLUMN_BOTTOM = X_TOP + RAIL_HEIGHT + PAD_HEIGHT
COLUMN_TOP, COLUMN_FRONT = 2.06, -0.35
SPINDLE_Y = 1.28  # height of the spindle axis
Y_RAILS, Y_PADS, Y_SPAN = (-0.33, 0.33), (SPINDLE_Y - 0.18, SPINDLE_Y + 0.18), (0.55, 2.01)
Y_SCREW_Z, Y_SCREW_SPAN = COLUMN_FRONT + 0.03, (0.60, 1.98)

HEADSTOCK_BACK = COLUMN_FRONT + RAIL_HEIGHT + PAD_HEIGHT
QUILL_FRONT, FLANGE_RADIUS = 0.14, 0.15  # seat of the spindle

CARRIAGE_BOTTOM = Z_TOP + RAIL_HEIGHT + PAD_HEIGHT
CARRIAGE_TOP, CARRIAGE_Z = CARRIAGE_BOTTOM + 0.12, 1.10  # axis B stands in the middle of the carriage
Z_RAILS, Z_PADS, Z_SPAN = (-0.33, 0.33), (CARRIAGE_Z - 0.24, CARRIAGE_Z + 0.24), (0.36, 1.84)
Z_SCREW_Y, Z_SCREW_SPAN = Z_TOP + 0.025, (0.36, 1.84)
B_RADIUS, C_RADIUS = 0.34, 0.20  # bearings of the rotary axes
TABLE_Y, TABLE_BACK = 1.22, 1.12  # axis C and the plane of its bearing


def bed() -> Solid:
    """T-shaped casting, ribbed and open below, on six feet: the rear bar carries the X axis, the stem the Z axis."""
    floor, wall, foot = 0.05, 0.06, 0.14
    half, back, shoulder, front, stem = 0.92, -1.00, -0.30, 1.90, 0.45
    pockets = []
    width = (2 * half - 5 * wall) / 4
    for i in range(4):
        x = -half + wall + i * (width + wall)
        pockets.append(block((x, x + width), (floor, X_TOP - wall), (back + wall, shoulder - wall)))
    depth = (front - shoulder - 4 * wall) / 4
    for i in range(4):
        z = shoulder + i * (depth + wall)
        pockets.append(block((-stem + wall, stem - wall), (floor, Z_TOP - wall), (z, z + depth)))
    corners = [(x, z) for z in (back, shoulder - foot) for x in (-half, half - foot)]
    corners += [(-stem, front - foot), (stem - foot, front - foot)]
    feet = [((x, x + foot), (z, z + foot)) for x, z in corners]
    x_bracket = ((half - wall, half), (X_TOP, X_TOP + 0.12), around(X_SCREW_Z, MOTOR))
    z_bracket = (around(0, MOTOR), (Z_TOP, Z_TOP + 0.12), (front - wall, front))
    return Solid(
        "bed",
        add=(
            block((-half, half), (floor, X_TOP), (back, shoulder)),
            block((-stem, stem), (floor, Z_TOP), (shoulder, front)),
            block(*x_bracket),
            block(*z_bracket),
            *(block(x, (0.0, floor), z) for x, z in feet),
        ),
        cut=tuple(pockets),
        patches=(
            *(Patch(f"x_rail_{i}_seat", rectangle(X_SPAN, X_TOP, around(z, RAIL_WIDTH)))
              for i, z in enumerate(X_RAILS, 1)),
            *(Patch(f"z_rail_{i}_seat", rectangle(around(x, RAIL_WIDTH), Z_TOP, Z_SPAN))
              for i, x in enumerate(Z_RAILS, 1)),
            Patch("x_screw_seat", rectangle(half - wall, around(X_SCREW_Y, SCREW), around(X_SCREW_Z, SCREW))),
            Patch("z_screw_seat", rectangle(around(0, SCREW), around(Z_SCREW_Y, SCREW), front - wall)),
            Patch("x_motor", rectangle(half, (X_TOP - 0.20, X_TOP + 0.12), around(X_SCREW_Z, MOTOR))),
            Patch("z_motor", rectangle(around(0, MOTOR), (Z_TOP - 0.12, Z_TOP + 0.12), front)),
        ),
        regions=(
            *(region(f"foot_{i}", x, 0.0, z) for i, (x, z) in enumerate(feet, 1)),
            region("x_bracket", *x_bracket),
            region("z_bracket", *z_bracket),
            region("left", x=-half),
            region("right", x=half),
            region("back", z=back),
            region("front", z=front),
            region("shoulder", z=shoulder),
            region("x_top", y=X_TOP),
            region("z_top", y=Z_TOP),
            region("stem_left", x=-stem),
            region("stem_right", x=stem),
            region("bottom", y=(0.0, floor)),
        ),
        rest="inside",
    )  # fmt: skip


def column() -> Solid:
    """Hollow box with two horizontal ribs, tapered behind, open at the back through three windows."""
    half, back, top_back, knee, wall = 0.45, -0.95, -0.70, 0.95, 0.07
    slope = (top_back - back) / (COLUMN_TOP - knee)

    def back_at(y: float) -> float:
        return back + max(0.0, y - knee) * slope

    inner_front = COLUMN_FRONT - 0.09
    floors = (COLUMN_BOTTOM, knee + 0.03, 1.53, COLUMN_TOP)
    cells, windows = [], []
    for low, high in pairwise(floors):
        y0, y1 = low + wall, high - (0.09 if high == COLUMN_TOP else 0.0)
        side = [(inner_front, y0), (inner_front, y1), (back_at(y1) + wall, y1), (back_at(y0) + wall, y0)]
        if y0 < knee < y1:
            side.insert(3, (back + wall, knee))
        cells.append(profile((-half + wall, half - wall), tuple(side)))
        windows.append(block((-0.24, 0.24), (y0 + 0.06, y1 - 0.06), (back - 0.01, back_at(y1) + wall + 0.02)))
    bracket = (around(0, MOTOR), (Y_SCREW_SPAN[1], COLUMN_TOP), (COLUMN_FRONT, -0.27))
    pads = [(around(x, PAD_LENGTH), around(z, RAIL_WIDTH)) for z in X_RAILS for x in X_PADS]
    nut_z = X_SCREW_Z + SCREW / 2 + 0.01
    nut = (around(0, NUT_LENGTH), (COLUMN_BOTTOM - NUT_DEPTH, COLUMN_BOTTOM), (nut_z, nut_z + 0.06))
    outline = (
        (COLUMN_FRONT, COLUMN_BOTTOM), (COLUMN_FRONT, COLUMN_TOP), (top_back, COLUMN_TOP), (back, knee),
        (back, COLUMN_BOTTOM),
    )  # fmt: skip
    return Solid(
        "column",
        add=(
            profile((-half, half), outline),
            block(*bracket),
            block(*nut),
            *(block(x, (COLUMN_BOTTOM - PAD_HEIGHT, COLUMN_BOTTOM), z) for x, z in pads),
        ),
        cut=(*cells, *windows),
        patches=(
            *(Patch(f"y_rail_{i}_seat", rectangle(around(x, RAIL_WIDTH), Y_SPAN, COLUMN_FRONT))
              for i, x in enumerate(Y_RAILS, 1)),
            Patch("y_screw_seat", rectangle(around(0, SCREW), Y_SCREW_SPAN[1], around(Y_SCREW_Z, SCREW))),
            Patch("y_motor", rectangle(around(0, 0.44), COLUMN_TOP, (-0.66, -0.42))),  # drives the screw by a belt
        ),
        regions=(
            *(region(f"pad_{i}", x, COLUMN_BOTTOM - PAD_HEIGHT, z) for i, (x, z) in enumerate(pads, 1)),
            region("x_nut", nut[0], nut[1], nut_z),
            region("y_bracket", *bracket),
            region("left", x=-half),
            region("right", x=half),
            region("front", z=COLUMN_FRONT),
            region("top", y=COLUMN_TOP),
            region("bottom", y=(0.0, COLUMN_BOTTOM)),
            region("back", z=back),
            region("back", y=(knee, COLUMN_TOP), z=(back, top_back), x=(-half, half)),
        ),
        rest="inside",
    )  # fmt: skip


def headstock() -> Solid:
    """Slide plate with the quill housing in front of it; the stator of the built-in spindle motor lines the bore."""
    half, high, plate_front, quill, bore = 0.41, 0.28, HEADSTOCK_BACK + 0.12, 0.17, 0.09
    pads = [(around(x, RAIL_WIDTH), around(y, PAD_LENGTH)) for y in Y_PADS for x in Y_RAILS]
    nut_x = SCREW / 2 + 0.01
    nut = ((nut_x, nut_x + 0.06), around(SPINDLE_Y + 0.19, NUT_LENGTH), (HEADSTOCK_BACK - NUT_DEPTH, HEADSTOCK_BACK))
    return Solid(
        "headstock",
        add=(
            block((-half, half), (SPINDLE_Y - high, SPINDLE_Y + high), (HEADSTOCK_BACK, plate_front)),
            block((-quill, quill), (SPINDLE_Y - quill, SPINDLE_Y + quill), (plate_front, QUILL_FRONT)),
            block(*nut),
            *(block(x, y, (HEADSTOCK_BACK - PAD_HEIGHT, HEADSTOCK_BACK)) for x, y in pads),
        ),
        cut=(block((-bore, bore), (SPINDLE_Y - bore, SPINDLE_Y + bore), (HEADSTOCK_BACK, QUILL_FRONT - 0.10)),),
        patches=(Patch("spindle_seat", octagon("z", (0.0, SPINDLE_Y, QUILL_FRONT), FLANGE_RADIUS)),),
        regions=(
            *(region(f"pad_{i}", x, y, HEADSTOCK_BACK - PAD_HEIGHT) for i, (x, y) in enumerate(pads, 1)),
            region("y_nut", nut_x, nut[1], nut[2]),
            region("back", z=(-1.0, HEADSTOCK_BACK)),
            region("left", x=-half),
            region("right", x=half),
            region("top", y=SPINDLE_Y + high),
            region("bottom", y=SPINDLE_Y - high),
            region("front", z=plate_front),
            region("quill_front", z=QUILL_FRONT),
            region("spindle_motor", (-bore, bore), (SPINDLE_Y - bore, SPINDLE_Y + bore)),
        ),
        rest="quill",
    )


def spindle() -> Solid:
    """Spindle housing with shaft as one steel body: flange, neck, nose."""
    flange = 0.05
    return Solid(
        "spindle",
        add=(
            disc("z", (0.0, SPINDLE_Y, QUILL_FRONT), FLANGE_RADIUS, flange),
            disc("z", (0.0, SPINDLE_Y, QUILL_FRONT + flange), 0.10, 0.21),
        ),
        regions=(region("flange", z=QUILL_FRONT), region("nose", z=QUILL_FRONT + flange + 0.21)),
        rest="neck",
    )


def carriage() -> Solid:
    half, depth = 0.42, 0.66
    front, back = around(CARRIAGE_Z, depth)[1], around(CARRIAGE_Z, depth)[0]
    pads = [(around(x, RAIL_WIDTH), around(z, PAD_LENGTH)) for z in Z_PADS for x in Z_RAILS]
    nut_x = SCREW / 2 + 0.01
    nut = ((nut_x, nut_x + 0.06), (CARRIAGE_BOTTOM - NUT_DEPTH, CARRIAGE_BOTTOM), around(CARRIAGE_Z, NUT_LENGTH))
    return Solid(
        "carriage",
        add=(
            block((-half, half), (CARRIAGE_BOTTOM, CARRIAGE_TOP), (back, front)),
            block(*nut),
            *(block(x, (CARRIAGE_BOTTOM - PAD_HEIGHT, CARRIAGE_BOTTOM), z) for x, z in pads),
        ),
        patches=(Patch("b_bearing", octagon("y", (0.0, CARRIAGE_TOP, CARRIAGE_Z), B_RADIUS)),),
        regions=(
            *(region(f"pad_{i}", x, CARRIAGE_BOTTOM - PAD_HEIGHT, z) for i, (x, z) in enumerate(pads, 1)),
            region("z_nut", nut_x, nut[1], nut[2]),
            region("left", x=-half),
            region("right", x=half),
            region("front", z=front),
            region("back", z=back),
            region("top", y=CARRIAGE_TOP),
        ),
        rest="bottom",
    )


def swivel() -> Solid:
    """The body of axis B: turntable with an upright console that carries axis C; two gussets behind."""
    top, wall_back = CARRIAGE_TOP + 0.14, TABLE_BACK + 0.16
    gusset = ((wall_back, top), (wall_back + 0.08, top), (wall_back + 0.08, top + 0.06), (wall_back, top + 0.60))
    return Solid(
        "swivel",
        add=(
            disc("y", (0.0, CARRIAGE_TOP, CARRIAGE_Z), B_RADIUS, top - CARRIAGE_TOP),
            block((-0.24, 0.24), (top, TABLE_Y + 0.30), (TABLE_BACK, wall_back)),
            *(profile(around(x, 0.06), gusset) for x in (-0.12, 0.12)),
        ),
        patches=(Patch("c_bearing", octagon("z", (0.0, TABLE_Y, TABLE_BACK), C_RADIUS)),),
        regions=(
            region("b_bearing", y=CARRIAGE_TOP),
            region("turntable", y=(CARRIAGE_TOP, top)),
            region("face", z=TABLE_BACK),
            region("top", y=TABLE_Y + 0.30),
            region("left", x=-0.24),
            region("right", x=0.24),
        ),
        rest="back",
    )


def table() -> Solid:
    """The body of axis C: hub and octagonal face plate, facing the spindle."""
    hub, plate = 0.04, 0.08
    top = TABLE_BACK - hub - plate
    return Solid(
        "table",
        add=(
            disc("z", (0.0, TABLE_Y, TABLE_BACK - hub), C_RADIUS, hub),
            disc("z", (0.0, TABLE_Y, top), 0.32, plate),
        ),
        regions=(
            region("c_bearing", z=TABLE_BACK),
            region("top", z=top),
            region("back", z=(TABLE_BACK - hub, TABLE_BACK)),
        ),
        rest="rim",
    )


def rails() -> tuple[Solid, ...]:
    def rail(name: str, axis: str, normal: str, spans: tuple[Span, Span, Span]) -> Solid:
        low, high = spans[AXES.index(normal)]
        regions = (region("bottom", **{normal: low}), region("top", **{normal: high}))
        return Solid(name, (along(axis, *spans),), "sides", regions=regions, bar=True)

    x_height, z_height = (X_TOP, X_TOP + RAIL_HEIGHT), (Z_TOP, Z_TOP + RAIL_HEIGHT)
    y_height = (COLUMN_FRONT, COLUMN_FRONT + RAIL_HEIGHT)
    return (
        *(rail(f"x_rail_{i}", "x", "y", (X_SPAN, x_height, around(z, RAIL_WIDTH))) for i, z in enumerate(X_RAILS, 1)),
        *(rail(f"y_rail_{i}", "y", "z", (around(x, RAIL_WIDTH), Y_SPAN, y_height)) for i, x in enumerate(Y_RAILS, 1)),
        *(rail(f"z_rail_{i}", "z", "y", (around(x, RAIL_WIDTH), z_height, Z_SPAN)) for i, x in enumerate(Z_RAILS, 1)),
    )


def screws() -> tuple[Solid, ...]:
    def screw(axis: str, spans: tuple[Span, Span, Span]) -> Solid:
        free, fixed = spans[AXES.index(axis)]
        regions = (region("fixed_end", **{axis: fixed}), region("free_end", **{axis: free}))
        return Solid(f"{axis}_screw", (along(axis, *spans),), "thread", regions=regions, bar=True)

    return (
        screw("x", (X_SCREW_SPAN, around(X_SCREW_Y, SCREW), around(X_SCREW_Z, SCREW))),
        screw("y", (around(0, SCREW), Y_SCREW_SPAN, around(Y_SCREW_Z, SCREW))),
        screw("z", (around(0, SCREW), around(Z_SCREW_Y, SCREW), Z_SCREW_SPAN)),
    )


def solids() -> tuple[Solid, ...]:
    """All parts, the bed first."""
    return (bed(), column(), headstock(), spindle(), carriage(), swivel(), table(), *rails(), *screws())
