"""The castings of the ram borer as blocks [m]. Machine coordinates as in machine.toml, axes at position zero."""

from __future__ import annotations

from grid import Block, Casting, Region

FAR = 10.0  # m, beyond the machine
GROUND = 0.10  # m, underside of the bed
FLOOR, PEDESTAL, HEAD = 0.60, 1.40, 3.95  # m, heights of the bed's top, of the column's seat and of its head
LEG = (0.46, 0.86)  # m, from the middle plane: the legs of the column and the pedestals below them
WALL, FRONT, DEPTH = 0.025, 0.040, 0.50  # m, walls of the legs (the front carries the guides) and their depth along Z
GUIDE = (0.56, 0.66)  # m, from the middle plane: the guides of Y


def both_sides(low: float, high: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """The interval left and right of the middle plane."""
    return (-high, -low), (low, high)


def bed() -> Casting:
    """The bed with the saddle below the table and the pedestals below the column: stiff, heavy, on six feet."""
    table = (-2.25, -1.25)  # m, along Z
    pedestals = [Block((a, FLOOR, 0.0), (b, PEDESTAL, 1.10)) for a, b in both_sides(*LEG)]
    feet = [
        Region(f"foot_{2 * i + k + 1}", (a, GROUND, front), (b, GROUND, rear))
        for i, (front, rear) in enumerate(((-2.60, -2.25), (-1.25, -0.90), (1.10, 1.40)))
        for k, (a, b) in enumerate(both_sides(*LEG))
    ]
    return Casting(
        name="bed",
        planes=(
            (-0.95, -0.86, -0.46, 0.46, 0.86, 0.95),
            (GROUND, 0.35, FLOOR, 1.20, PEDESTAL),
            (-2.60, *table, -0.90, 0.0, DEPTH, 1.10, 1.40),
        ),
        solid=(
            Block((-0.95, GROUND, -2.60), (0.95, FLOOR, 1.40)),
            Block((-0.46, FLOOR, table[0]), (0.46, 1.20, table[1])),
            *pedestals,
        ),
        regions=(
            *feet,
            Region("bottom", (-FAR, GROUND, -FAR), (FAR, GROUND, FAR)),
            Region("column_seat", (-FAR, PEDESTAL, 0.0), (FAR, PEDESTAL, DEPTH)),
            Region("rail_seat", (-FAR, FLOOR, 0.0), (FAR, PEDESTAL, 0.0)),
            Region("table_seat", (-FAR, 1.20, table[0]), (FAR, 1.20, table[1])),
        ),
        rest="outside",
        coarseness=1.8,
    )


def column() -> Casting:
    """Two hollow legs with a plate across their heads; the headstock stands before and between them."""
    legs, hollows, inside = [], [], []
    for low, high in both_sides(*LEG):
        legs.append(Block((low, PEDESTAL, 0.0), (high, HEAD, DEPTH)))
        hollow = Block((low + WALL, PEDESTAL, FRONT), (high - WALL, HEAD, DEPTH - WALL))
        hollows.append(hollow)
        inside.append(Region("inside", hollow.low, hollow.high))
    return Casting(
        name="column",
        planes=(
            (-0.86, -0.835, -0.485, -0.46, 0.46, 0.485, 0.835, 0.86),
            (PEDESTAL, HEAD, HEAD + 0.05),
            (0.0, FRONT, DEPTH - WALL, DEPTH),
        ),
        solid=(*legs, Block((-0.86, HEAD, 0.0), (0.86, HEAD + 0.05, DEPTH))),
        hollow=tuple(hollows),
        regions=(
            Region("seat", (-FAR, PEDESTAL, -FAR), (FAR, PEDESTAL, FAR)),
            Region("front", (-FAR, PEDESTAL, 0.0), (FAR, HEAD, 0.0)),
            *inside,
            Region("scale_seat", (LEG[0], PEDESTAL, 0.0), (LEG[0], HEAD, FRONT), "-x"),
        ),
        rest="outside",
    )


def headstock() -> Casting:
    """A body before the column with a gear chamber on either side of the ram's bore, and a sleeve between the legs.

    Guide pads and nut of Y stand on its back, the pads of the ram are faces of its bore.
    """
    low, high, front, back, rear = 0.75, 2.05, -0.55, -0.09, 0.55
    bore_low, bore_high, slide = 1.48, 1.92, -0.05  # slide: the plane of the pads
    lower, upper = (low, 0.95), (1.20, bore_low)  # heights of the pads
    chambers = [Block((a, 0.95, -0.45), (b, bore_low, -0.19)) for a, b in both_sides(0.30, GUIDE[0])]
    pads = [Block((a, y[0], back), (b, y[1], slide)) for a, b in both_sides(*GUIDE) for y in (lower, upper)]
    nut = Block((0.46, 1.75, back), (GUIDE[0], bore_high, slide))
    ram_pads = [
        Region(f"z_pad_{i}", (x, 1.65, a), (x, 1.75, b))
        for i, (x, a, b) in enumerate(
            ((-0.22, -0.45, -0.19), (0.22, -0.45, -0.19), (-0.22, -0.05, 0.12), (0.22, -0.05, 0.12)), start=1
        )
    ]
    return Casting(
        name="headstock",
        planes=(
            (-0.66, -0.56, -0.30, -0.22, 0.22, 0.30, 0.46, 0.56, 0.66),
            (low, 0.95, 1.20, bore_low, 1.65, 1.75, bore_high, high),
            (front, -0.45, -0.19, back, slide, 0.12, rear),
        ),
        solid=(
            Block((-0.66, low, front), (0.66, high, back)),
            Block((-0.30, 1.20, back), (0.30, high, rear)),
            *pads,
            nut,
        ),
        hollow=(Block((-0.22, bore_low, front), (0.22, bore_high, rear)), *chambers),
        regions=(
            *(Region("gear_chambers", c.low, c.high) for c in chambers),
            *ram_pads,
            Region("bore_top", (-0.22, bore_high, front), (0.22, bore_high, rear)),
            Region("bore", (-0.22, bore_low, front), (0.22, bore_high, rear)),
            *(
                Region(f"y_pad_{i}", (b.low[0], b.low[1], slide), (b.high[0], b.high[1], slide))
                for i, b in enumerate(pads, start=1)
            ),
            Region("y_nut", (nut.low[0], nut.low[1], slide), (nut.high[0], nut.high[1], slide)),
            Region("motor_seat", (-0.22, high, -0.09), (0.22, high, rear)),
        ),
        rest="outside",
    )


def ram() -> Casting:
    """A tube with a rail on either side, the drive shaft in its bore and the bearing cartridge on its front."""
    low, high, front, rear = 1.55, 1.85, -0.75, 0.55
    bore = Block((-0.08, low + 0.07, front), (0.08, high - 0.07, rear))
    rails = [Block((a, low + 0.07, front), (b, high - 0.07, rear)) for a, b in both_sides(0.15, 0.22)]
    return Casting(
        name="ram",
        planes=(
            (-0.22, -0.15, -0.08, 0.08, 0.15, 0.22),
            (low, low + 0.07, high - 0.07, high),
            (front, 0.29, rear),
        ),
        solid=(Block((-0.15, low, front), (0.15, high, rear)), *rails),
        hollow=(bore,),
        regions=(
            Region("bore", bore.low, bore.high),
            Region("front", (-FAR, low, front), (FAR, high, front)),
            Region("rear", (-FAR, low, rear), (FAR, high, rear)),
            Region("rail_1", (-0.22, low, front), (-0.22, high, rear)),
            Region("rail_2", (0.22, low, front), (0.22, high, rear)),
            Region("nut", (-0.08, high, 0.29), (0.08, high, rear)),
        ),
        rest="outside",
    )


def castings() -> tuple[Casting, ...]:
    return bed(), column(), headstock(), ram()
