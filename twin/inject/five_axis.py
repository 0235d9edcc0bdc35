"""Where things are hidden in the machine of models/five_axis: names of its surfaces, films, joints and signals."""

from __future__ import annotations

ROOM, ENCLOSURE = 0, 1  # environments
OUTER = {
    "bed.left": ROOM, "bed.right": ROOM, "bed.back": ROOM, "bed.front": ROOM, "bed.shoulder": ROOM, "bed.x_top": ROOM,
    "bed.z_top": ROOM, "bed.stem_left": ROOM, "bed.stem_right": ROOM, "column.left": ROOM, "column.right": ROOM,
    "column.front": ROOM, "column.top": ROOM, "column.back": ROOM, "headstock.back": ENCLOSURE,
    "headstock.left": ENCLOSURE, "headstock.right": ENCLOSURE, "headstock.top": ENCLOSURE, "headstock.front": ENCLOSURE,
    "carriage.left": ENCLOSURE, "carriage.right": ENCLOSURE, "carriage.front": ENCLOSURE, "carriage.back": ENCLOSURE,
    "carriage.top": ENCLOSURE, "swivel.face": ENCLOSURE, "swivel.left": ENCLOSURE, "swivel.right": ENCLOSURE,
    "swivel.back": ENCLOSURE, "table.top": ENCLOSURE, "table.back": ENCLOSURE,
}  # fmt: skip
LARGE = ("bed.z_top", "bed.x_top", "bed.stem_left", "bed.stem_right", "bed.back", "column.left", "column.right",
         "column.back", "column.front", "headstock.back", "headstock.front", "swivel.back", "table.top")  # fmt: skip
SPEEDS = {"column": "x_speed", "headstock": "y_speed", "carriage": "z_speed", "swivel": "z_speed", "table": "z_speed"}
WETTED = ("table.top", "table.back", "swivel.face", "carriage.top", "bed.z_top", "bed.stem_left", "bed.stem_right")
PARTS = ("bed", "column", "headstock", "carriage", "swivel", "spindle")
BODIES = ("bed", "column", "headstock", "carriage")
# Joints that heat crosses in these runs; the bearing of B and the guide of Z hardly carry any
JOINTS = ("spindle_flange", "x_screw_bearing", "y_screw_bearing", "z_screw_bearing", "x_guide", "y_guide", "x_nut",
          "y_nut", "z_nut")  # fmt: skip
# m^2 of sides that the sun reaches, by `twin.build.places`
SIDES = {"bed.left": 0.29, "bed.right": 0.25, "bed.stem_left": 0.67, "bed.stem_right": 0.67, "column.left": 0.79,
         "column.right": 0.79}  # fmt: skip
DRIVES = ("x_motor", "y_motor", "z_motor", "x_bearing", "y_bearing", "z_bearing", "spindle_motor", "spindle_bearing",
          "x_guide", "y_guide", "z_guide")  # fmt: skip
BEARINGS = {"x_bearing": "x_motor_speed", "y_bearing": "y_motor_speed", "z_bearing": "z_motor_speed",
            "spindle_bearing": "spindle_speed"}  # fmt: skip
# A source on a surface: where else on its part its heat may enter
ELSEWHERE = {
    "x_motor": ("bed.right", "bed.back", "bed.x_top"), "y_motor": ("column.front", "column.back", "column.right"),
    "z_motor": ("bed.z_top", "bed.stem_right", "bed.front"), "x_bearing": ("bed.right", "bed.x_top", "bed.shoulder"),
    "y_bearing": ("column.front", "column.right", "column.left"), "z_bearing": ("bed.z_top", "bed.stem_left"),
    "spindle_motor": ("headstock.back", "headstock.front", "headstock.top"), "spindle_bearing": ("spindle.nose",),
}  # fmt: skip
SCALES = {
    "x": ("x_rail_1.sides", "bed.x_top"),
    "y": ("y_rail_1.sides", "column.front"),
    "z": ("z_rail_1.sides", "bed.z_top"),
}
