"""The rows of the table of laws that give film coefficients and joint conductances [W/(m^2 K)]."""

from __future__ import annotations

from twin.physics import coolant, films, forced_convection, free_convection, joints
from twin.physics.law import Argument, Law, Validity

_ANY = -float("inf")
_STATES = {
    "surface": Argument("degC", "mean temperature of the film's surfaces", low=-273.15),
    "ambient": Argument("degC", "temperature of the film's environment", low=-273.15),
}
_WIND = {"speed": Argument("m/s", "speed of the surface through the air", low=_ANY)}
_TURNING = {"speed": Argument("1/s", "speed of rotation", low=_ANY)}
_TINY = 1e-4  # m
_HEIGHT = {"height": Argument("m", "height of the surface", None, _TINY)}
_ACROSS = {"length": Argument("m", "area over perimeter, a b / (2 (a + b))", None, _TINY)}
_DIAMETER = {"diameter": Argument("m", "diameter", None, _TINY)}
_ALONG = {"length": Argument("m", "length along the flow", None, _TINY)}
_MIXED = "h^3 = h_forced^3 + h_free^3"
_LEVEL = {
    "length": Argument("m", "length along the motion", None, _TINY),
    "area_over_perimeter": Argument("m", "area over perimeter, a b / (2 (a + b))", None, _TINY),
}
_AIR = "film 0 to 80 degC"
_SLIGHT = "(lower limits from 0.5 K on)"

FILMS: dict[str, Law] = {
    "constant_film": Law(
        films.constant_film, "film", "literature value, paper 000 eq (7)",
        {}, {"natural": Argument("W/(m^2*K)", "film coefficient of natural convection")},
        formula="h = constant",
    ),
    "forced_film": Law(
        films.forced_film, "film", "paper 000 eq (7): natural part plus forced part of moving components",
        _WIND,
        {
            "natural": Argument("W/(m^2*K)", "film coefficient at rest"),
            "forced": Argument("W/(m^2*K)", "additional film coefficient at 1 m/s"),
            "exponent": Argument("1", "exponent of the speed", 0.8, 0.1, 1.0),
        },
        formula="h = h_natural + h_forced |v|^m, v in m/s",
    ),
    "free_vertical_plate": Law(
        free_convection.free_vertical_plate, "film", "Churchill and Chu 1975, VDI-Waermeatlas F2",
        {}, _HEIGHT, _STATES,
        "Nu = (0.825 + 0.387 (Ra f1)^(1/6))^2",
        Validity(free_convection.free_vertical_plate_holds, f"0.1 < Ra < 1e12 {_SLIGHT}, {_AIR}"),
    ),
    "free_vertical_plate_laminar": Law(
        free_convection.free_vertical_plate_laminar, "film", "Churchill and Chu 1975, Incropera",
        {}, _HEIGHT, _STATES,
        "Nu = 0.68 + 0.670 Ra^(1/4) / [1 + (0.492/Pr)^(9/16)]^(4/9)",
        Validity(free_convection.free_vertical_plate_laminar_holds, f"Ra <= 1e9, {_AIR}"),
    ),
    "free_inclined_plate": Law(
        free_convection.free_inclined_plate, "film", "VDI-Waermeatlas F2",
        {},
        {
            "length": Argument("m", "length along the slope", None, _TINY),
            "angle": Argument("rad", "from the vertical, positive where the surface faces up", None, -1.5708, 1.5708),
        },
        _STATES,
        "vertical plate with Ra cos(angle); hot side up beyond Ra_c = 10^(8.9 - 0.00178 angle^1.82): "
        "Nu = 0.56 (Ra_c cos(angle))^(1/4) + 0.13 (Ra^(1/3) - Ra_c^(1/3))",
        Validity(
            free_convection.free_inclined_plate_holds,
            f"|angle| <= 60 degrees, 0.1 < Ra cos(angle) < 1e9 (hot side down) or 1e12 {_SLIGHT}, {_AIR}",
        ),
    ),
    "free_horizontal_up": Law(
        free_convection.free_horizontal_up, "film", "VDI-Waermeatlas F2",
        {}, _ACROSS, _STATES,
        "hot: Nu = 0.766 (Ra f2)^(1/5) to Ra f2 = 7e4, 0.15 (Ra f2)^(1/3) beyond; cold: Nu = 0.6 (Ra f1)^(1/5)",
        Validity(
            free_convection.free_horizontal_up_holds, f"hot: Ra f2 < 1e12; cold: 1e3 < Ra f1 < 1e10 {_SLIGHT}, {_AIR}"
        ),
    ),
    "free_horizontal_down": Law(
        free_convection.free_horizontal_down, "film", "VDI-Waermeatlas F2",
        {}, _ACROSS, _STATES,
        "hot: Nu = 0.6 (Ra f1)^(1/5); cold: Nu = 0.766 (Ra f2)^(1/5) to Ra f2 = 7e4, 0.15 (Ra f2)^(1/3) beyond",
        Validity(
            free_convection.free_horizontal_down_holds, f"hot: 1e3 < Ra f1 < 1e10; cold: Ra f2 < 1e12 {_SLIGHT}, {_AIR}"
        ),
    ),
    "free_horizontal_up_incropera": Law(
        free_convection.free_horizontal_up_incropera, "film", "McAdams 1954, Incropera 7th ed.",
        {}, _ACROSS, _STATES,
        "hot: Nu = 0.54 Ra^(1/4) to 1e7, 0.15 Ra^(1/3) beyond; cold: Nu = 0.52 Ra^(1/5)",
        Validity(
            free_convection.free_horizontal_up_incropera_holds,
            f"hot: 1e4 < Ra < 1e11; cold: 1e4 < Ra < 1e9 {_SLIGHT}, {_AIR}",
        ),
    ),
    "free_horizontal_down_incropera": Law(
        free_convection.free_horizontal_down_incropera, "film", "McAdams 1954, Incropera 7th ed.",
        {}, _ACROSS, _STATES,
        "hot: Nu = 0.52 Ra^(1/5); cold: Nu = 0.54 Ra^(1/4) to 1e7, 0.15 Ra^(1/3) beyond",
        Validity(
            free_convection.free_horizontal_down_incropera_holds,
            f"hot: 1e4 < Ra < 1e9; cold: 1e4 < Ra < 1e11 {_SLIGHT}, {_AIR}",
        ),
    ),
    "free_horizontal_cylinder": Law(
        free_convection.free_horizontal_cylinder, "film", "Churchill and Chu 1975",
        {}, _DIAMETER, _STATES,
        "Nu = (0.60 + 0.387 (Ra f3)^(1/6))^2",
        Validity(free_convection.free_horizontal_cylinder_holds, f"Ra <= 1e12, {_AIR}"),
    ),
    "free_vertical_cylinder": Law(
        free_convection.free_vertical_cylinder, "film", "Popiel 2008 on Churchill and Chu 1975",
        {}, {**_DIAMETER, **_HEIGHT}, _STATES,
        "as free_vertical_plate; D/L < 35/Gr^(1/4): times 1 + B [32^(1/2) Gr^(-1/4) L/D]^C",
        Validity(free_convection.free_vertical_cylinder_holds, f"0.1 < Ra < 1e12 {_SLIGHT}, {_AIR}"),
    ),
    "free_box": Law(
        free_convection.free_box, "film", "VDI-Waermeatlas F2 and Churchill and Chu 1975, by area",
        {},
        {
            "length": Argument("m", "horizontal edge", None, _TINY),
            "width": Argument("m", "other horizontal edge", None, _TINY),
            **_HEIGHT,
        },
        _STATES,
        "mean by area of four vertical faces, one hot face up and one hot face down",
        Validity(
            free_convection.free_box_holds,
            f"0.1 < Ra < 1e12 over the height, 1e3 < Ra f1 < 1e10 over area by perimeter {_SLIGHT}, {_AIR}",
        ),
    ),
    "forced_plate": Law(
        forced_convection.forced_plate, "film", "Pohlhausen, Petukhov, Gnielinski; VDI-Waermeatlas G",
        _WIND, _ALONG, _STATES,
        "Nu = sqrt(Nu_lam^2 + Nu_turb^2), Nu_lam = 0.664 Re^(1/2) Pr^(1/3), "
        "Nu_turb = 0.037 Re^0.8 Pr / [1 + 2.443 Re^(-0.1) (Pr^(2/3) - 1)]",
        Validity(forced_convection.forced_plate_holds, f"10 < Re < 1e7, {_AIR}"),
    ),
    "forced_cylinder": Law(
        forced_convection.forced_cylinder, "film", "Churchill and Bernstein 1977",
        _WIND, _DIAMETER, _STATES,
        "Nu = 0.3 + 0.62 Re^(1/2) Pr^(1/3) / [1 + (0.4/Pr)^(2/3)]^(1/4) [1 + (Re/282000)^(5/8)]^(4/5)",
        Validity(forced_convection.forced_cylinder_holds, f"10 < Re < 1e7, {_AIR}"),
    ),
    "forced_bar": Law(
        forced_convection.forced_bar, "film", "Incropera, Table 7.3 (not checked in the original)",
        _WIND,
        {
            "height": Argument("m", "height across the flow", None, _TINY),
            "constant": Argument("1", "C: square face on 0.102, edge on 0.246, hexagon 0.153", 0.102),
            "exponent": Argument("1", "m: square face on 0.675, edge on 0.588, hexagon 0.638", 0.675, 0.1, 1.0),
        },
        _STATES,
        "Nu = C Re^m Pr^(1/3)",
        Validity(forced_convection.forced_bar_holds, f"5e3 < Re < 1e5, {_AIR}"),
    ),
    "rotating_cylinder": Law(
        forced_convection.rotating_cylinder, "film", "Becker 1963 (not checked in the original)",
        _TURNING, _DIAMETER, _STATES,
        "Nu = 0.133 Re^(2/3) Pr^(1/3), Re = omega D^2 / nu",
        Validity(forced_convection.rotating_cylinder_holds, f"10 < Re < 4.3e5, {_AIR}"),
    ),
    "mixed_plate": Law(
        forced_convection.mixed_plate, "film", "VDI-Waermeatlas; forced_plate and free_vertical_plate",
        _WIND, {"length": Argument("m", "length along the motion", None, _TINY), **_HEIGHT}, _STATES,
        f"{_MIXED} of forced_plate and free_vertical_plate",
        Validity(forced_convection.mixed_plate_holds, f"Re < 1e7, 0.1 < Ra < 1e12 {_SLIGHT}, {_AIR}"),
    ),
    "mixed_plate_two_axes": Law(
        forced_convection.mixed_plate_two_axes, "film",
        "VDI-Waermeatlas; mixed_plate at the length of the velocity vector",
        {**_WIND, "speed_across": Argument("m/s", "speed of an axis square to the first", low=_ANY)},
        {"length": Argument("m", "length along the motion", None, _TINY), **_HEIGHT}, _STATES,
        "mixed_plate at v = sqrt(v1^2 + v2^2)",
        Validity(forced_convection.mixed_plate_two_axes_holds, f"Re < 1e7, 0.1 < Ra < 1e12 {_SLIGHT}, {_AIR}"),
    ),
    "mixed_horizontal_up": Law(
        forced_convection.mixed_horizontal_up, "film", "VDI-Waermeatlas; forced_plate and free_horizontal_up",
        _WIND, _LEVEL, _STATES,
        f"{_MIXED} of forced_plate and free_horizontal_up",
        Validity(
            forced_convection.mixed_horizontal_up_holds,
            f"Re < 1e7; hot: Ra f2 < 1e12; cold: 1e3 < Ra f1 < 1e10 {_SLIGHT}, {_AIR}",
        ),
    ),
    "mixed_horizontal_down": Law(
        forced_convection.mixed_horizontal_down, "film", "VDI-Waermeatlas; forced_plate and free_horizontal_down",
        _WIND, _LEVEL, _STATES,
        f"{_MIXED} of forced_plate and free_horizontal_down",
        Validity(
            forced_convection.mixed_horizontal_down_holds,
            f"Re < 1e7; hot: 1e3 < Ra f1 < 1e10; cold: Ra f2 < 1e12 {_SLIGHT}, {_AIR}",
        ),
    ),
    "mixed_cylinder": Law(
        forced_convection.mixed_cylinder, "film",
        "VDI-Waermeatlas; forced_cylinder and free_horizontal_cylinder",
        _WIND, _DIAMETER, _STATES,
        f"{_MIXED} of forced_cylinder and free_horizontal_cylinder",
        Validity(forced_convection.mixed_cylinder_holds, f"Re < 1e7, Ra <= 1e12, {_AIR}"),
    ),
    "mixed_rotating_cylinder": Law(
        forced_convection.mixed_rotating_cylinder, "film",
        "VDI-Waermeatlas; rotating_cylinder (Becker 1963, not checked in the original) and free_horizontal_cylinder",
        _TURNING, _DIAMETER, _STATES,
        f"{_MIXED} of rotating_cylinder and free_horizontal_cylinder",
        Validity(forced_convection.mixed_rotating_cylinder_holds, f"Re < 4.3e5, Ra <= 1e12, {_AIR}"),
    ),
    "logged_film": Law(
        films.logged_film, "film", "definition",
        {"coefficient": Argument("W/(m^2*K)", "logged film coefficient")}, {},
        formula="h = h_logged",
    ),
    "switched_film": Law(
        films.switched_film, "film", "assumed: what is switched is proportional to its time on",
        {"switch": Argument("1", "0 off, 1 on", low=0.0, high=1.0)},
        {"natural": Argument("W/(m^2*K)", "film coefficient where it is on")},
        formula="h = h_on s",
    ),
    "enclosed_gap": Law(
        films.enclosed_gap, "film", "assumed: the papers have no correlation for covers and enclosed gaps",
        {}, {"conductance": Argument("W/(m^2*K)", "convection and radiation through the gap together")},
        formula="h = constant",
        radiates=False,
    ),
    "coolant_channel": Law(
        coolant.coolant_channel, "film", "VDI-Waermeatlas C1 (stream along a wall), G1 (Gnielinski); erratum E-004-4",
        {"flow": Argument("m^3/s", "coolant flow", low=_ANY)},
        {
            "diameter": Argument("m", "diameter of the channel", None, _TINY),
            "channel_length": Argument("m", "length of the channel", None, _TINY),
            "area": Argument("m^2", "area of the film's surfaces; filled in by the build", None, 1e-9),
            "still": Argument("W/(m^2*K)", "film coefficient at rest", 1.0, 1e-3),
            "density": Argument("kg/m^3", "density of the coolant", 998.2, 1e-3),
            "heat_capacity": Argument("J/(kg*K)", "heat capacity of the coolant", 4184.0, 1.0),
            "conductivity": Argument("W/(m*K)", "conductivity of the coolant", 0.598, 1e-4),
            "viscosity": Argument("m^2/s", "kinematic viscosity of the coolant", 1.004e-6, 1e-9),
        },
        formula="h = h_still + rho c V (1 - exp(-NTU)) / A, NTU = h_wall pi d L / (rho c V); environment: the inlet",
        validity=Validity(coolant.coolant_channel_holds, "Re < 1e6, 0.1 <= Pr <= 1000, d <= L"),
        radiates=False,
    ),
}  # fmt: skip

JOINTS: dict[str, Law] = {
    "bolted_joint": Law(
        joints.bolted_joint, "joint",
        "paper 004 eqs (7)-(10) with errata E-004-5 and E-004-8; f_g: Negus, Yovanovich (not checked in the original)",
        {},
        {
            "conductivity_1": Argument("W/(m*K)", "conductivity of one part", None, 1e-3),
            "conductivity_2": Argument("W/(m*K)", "conductivity of the other", None, 1e-3),
            "roughness_1": Argument("m", "roughness of one surface, rms", None, 1e-9, 1e-3),
            "roughness_2": Argument("m", "roughness of the other, rms", None, 1e-9, 1e-3),
            "slope_1": Argument("1", "mean slope of one profile", None, 1e-6, 10.0),
            "slope_2": Argument("1", "mean slope of the other", None, 1e-6, 10.0),
            "hardness": Argument("Pa", "contact hardness of the softer surface", None, 1e6),
            "pressure": Argument("Pa", "contact pressure; 0: from the bolts", 0.0),
            "bolts": Argument("1", "number of bolts", 0.0),
            "torque": Argument("N*m", "tightening torque of a bolt", 0.0),
            "pitch": Argument("m", "pitch of the thread", 0.0),
            "flank_diameter": Argument("m", "flank diameter d2", 0.0),
            "bolt_friction": Argument("1", "friction of thread and head", 0.12, 0.01, 1.0),
            "hole_diameter": Argument("m", "diameter of the hole", 0.0),
            "head_diameter": Argument("m", "outer diameter of the head's seat", 0.0),
            "area": Argument("m^2", "area that the bolts press on", 0.0),
            "gas_conductivity": Argument("W/(m*K)", "conductivity of the gas (air) or oil in the gap", 0.0262, 1e-4),
            "rarefaction_length": Argument("m", "B, temperature jump as a length; 0 for oil", 0.37e-6),
            "factor": Argument("1", "f_g of the uneven gap; 0: by Negus and Yovanovich", 0.0),
        },
        formula="h = 1.25 k_s m/sigma (p/H)^0.95 + k_g f_g / (B + lambda sigma), lambda = 1.53 (p/H)^(-0.097), "
        "p = n M_A / {[0.16 P + mu (0.58 d2 + (d_h + d_w)/4)] A}",
        validity=Validity(joints.bolted_joint_holds, "1e-6 <= p/H <= 2.3e-2; f_g: B/sigma >= 0.01, 2 <= lambda <= 4"),
    ),
}  # fmt: skip
