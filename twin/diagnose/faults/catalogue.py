"""The catalogue: what may be wrong with a simulation, entry by entry.

An entry says what the cause is in physics, what it adds to x' = A(theta) x + B(theta) u, y = C x, how it betrays
itself, and the smallest size worth naming; and it lists its hypotheses as batches over the elementary causes. Users add
entries of their own: a Python file with `FAMILIES = (Family(...), ...)`, given as `twin diagnose --catalogue FILE`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from twin.diagnose.evidence.batch import Batch
from twin.diagnose.faults import hypotheses as of
from twin.diagnose.faults.hypotheses import Context
from twin.errors import TwinError
from twin.nearest import did_you_mean

VERSION = "1"


@dataclass(frozen=True)
class Family:
    """An entry of the catalogue."""

    number: int
    name: str
    title: str
    physics: str
    operator: str
    signature: str
    smallest: str  # size worth naming, with unit
    sign: str
    searched: str  # places and histories
    group: str  # "machine", "sensor", "signal", "reading": which verdict and which edit
    batches: Callable[[Context], list[Batch]]
    file: str = ""  # text of the user's file that it is from: what was made with another text is made again


FAMILIES: tuple[Family, ...] = (
    Family(
        1, "film_gain", "Film coefficient wrong",
        "A surface exchanges more or less heat with the air than its film law says: cover, dirt, draught, wrong law.",
        "eta (-A_f x + M_f (T_air - T_ref))",
        "residual goes with surface minus air, changes sign when the machine is colder than the air; time constants "
        "move",
        "1 W/(m^2 K) on a surface, 20 % of a film", "either", "every film and every surface with one, always",
        "machine",
        of.film_gain,
    ),
    Family(
        2, "forced_convection", "Convection by motion missing",
        "A moving part, or one that a moving part blows on, is cooled only while it moves.",
        "a |v|^0.6 (-A_f x + M_f (T_air - T_ref))",
        "cools only while an axis or the spindle turns", "1 W/(m^2 K) at top speed", "positive",
        "every film and surface with every logged speed", "machine", of.forced_convection,
    ),
    Family(
        3, "heat_source", "Heat source missing",
        "Something makes heat that the description does not have: electronics, hydraulics, a bearing, a lamp.",
        "b_place s(t)", "follows its own on and off, or a logged signal; independent of the air", "1 W", "positive",
        "every surface; always, every load signal, every window of hours", "machine", of.heat_source,
    ),
    Family(
        4, "loss_law", "Loss law or coefficient wrong",
        "Friction, winding resistance, preload or wear differ from the described law, in size or in shape.",
        "(a - 1) P_j(t), or b_j (s_alt - s_nom)", "goes with the power of one drive; or bends with its speed",
        "15 % of a source", "either", "every source: its gain, and other exponents of its speed", "machine",
        of.loss_law,
    ),
    Family(
        5, "joint", "Joint conductance wrong or lost",
        "A joint or guide conducts otherwise than described, perhaps since an event: preload lost, oil film gone.",
        "-kappa g(t) d d^T x", "residuals of opposite sign on both sides", "30 % of a conductance", "either",
        "every contact; always, and from every hour on", "machine", of.joint,
    ),
    Family(
        6, "zone", "One air temperature is not enough",
        "The air differs from where it is measured: warmer above, warmer in a zone, a door, a draught.",
        "a h_f M_f z, or g(t) h_f M_f dT", "goes with height, or with a door's hours; many sensors of one zone alike",
        "0.3 K (0.5 K at one film), 0.3 K/m", "either", "every environment, film and gradient; always and every window",
        "machine", of.zone,
    ),
    Family(
        7, "sun", "Sun or a hot neighbour on one side",
        "Radiation warms one side for some hours of the day; clouds make each day another.",
        "a_day b_side w(t)", "a bell of hours on one side, another height every day", "2 W", "positive",
        "every outer surface; bells of 4 to 10 h, an amplitude per run", "machine", of.sun,
    ),
    Family(
        8, "coolant", "Coolant or chips on a surface",
        "A liquid of its own temperature wets a surface while a valve is open.",
        "g(t) h (-A_p x + M_p (T_medium - T_ref))", "sharp onset and end; pulls the surface to one temperature",
        "5 W/(m^2 K)", "positive", "every surface with a film; every window of hours", "machine", of.coolant,
    ),
    Family(
        9, "sensor", "A temperature sensor is at fault",
        "Offset, drift, lag, contact to the part lost, stuck, or two sensors swapped. The machine model is left alone.",
        "y + a;  a t;  filter;  (1 - w) y + w T_air", "one channel only: neighbours and TCP agree with the model",
        "0.15 K, 0.1 K/day, 2 min, 5 %", "either", "every sensor; every pair", "sensor", of.sensor,
    ),
    Family(
        10, "signal", "A load signal is declared wrongly",
        "Peak logged as rms, line as phase current, 1/s as 1/min, or a clock that is off.",
        "u_k times an exact factor;  y(t - a)", "an exact factor in everything that reads the signal; a shift of all",
        "an exact factor; 0.5 min", "-", "every load signal with factors 2, sqrt 2, sqrt 3, 60; the clock of every run",
        "signal", of.signal,
    ),
    Family(
        11, "scale_expansion", "Encoder scale grows, and the description does not know",
        "A scale or a screw as scale grows with its part: the error grows with the position.",
        "-a (T_scale - T_ref) position", "TCP error linear in an axis position, with a part's temperature",
        "0.3 um/(m K)", "either", "every axis with every part", "machine", of.scale_expansion,
    ),
    Family(
        12, "expansion", "Expansion coefficient wrong",
        "A part grows more or less per kelvin than its material says: other alloy, other reference temperature.",
        "a C_part x", "displacements scale while temperatures fit", "5 %", "either", "every part, every material",
        "machine", of.expansion,
    ),
    Family(
        13, "slip", "A support or anchor slips",
        "Friction in a support holds the structure back until it slips: heating and cooling take different paths.",
        "play(w_thermal)", "displacement lags its own reversal by a fixed width; temperatures fit", "1 um", "positive",
        "every TCP component", "reading", of.slip,
    ),
    Family(
        14, "capacity", "Heat capacity missing",
        "An oil tank, a workpiece, a fixture takes part and is not described.",
        "C_t x_t' = k (T_surface - x_t)", "an extra slow pole at one place", "2 kJ/K", "positive", "every surface",
        "machine", of.capacity,
    ),
    Family(
        15, "initial_state", "The run starts from another state than stated",
        "The machine, or a part, was warmer or colder than the run says: yesterday's heat.",
        "T(0)", "decays with the model's own time constants from the first minute on", "0.2 K", "either",
        "the machine and every part, in every run", "reading", of.initial_state,
    ),
    Family(
        16, "coarse_model", "Reduced model or time step too coarse",
        "The artefact does not follow its own full model on this input: a note, never a cause.",
        "none: more states, a shorter step", "the artefact differs from the full model; the full model fits",
        "the noise of one reading (rms)", "-", "the artefact's runtime against the larger model of the diagnosis",
        "reading", of.none,
    ),
    Family(
        17, "measurement", "The measurement itself",
        "The probe drifts, the measuring frame is skewed, or measuring heats the machine.",
        "w + a t;  w + a position;  event input", "only in TCP rows; no sensor shares it", "1 um, 2 um/m", "either",
        "every TCP component: drift, every axis, growth within a measurement", "reading", of.measurement,
    ),
    Family(
        18, "misplaced_source", "A heat source is elsewhere",
        "The heat of a described source enters at another face of its part.",
        "P_j(t) (b_other - b_described)", "surplus here, lack there, both with one drive's power", "20 % of the heat",
        "positive", "every surface source to every face of its part", "machine", of.misplaced_source,
    ),
    Family(
        19, "not_thermal", "Not thermal",
        "A step at a tool change or a crash, or a displacement that follows a load at once.",
        "w + a 1(t > t0);  w + a |load|", "faster than the fastest pole of the machine", "2 um", "either",
        "every TCP component: a step from every measurement on, every current", "reading", of.not_thermal,
    ),
)  # fmt: skip


def family(name: str, families: tuple[Family, ...] = FAMILIES) -> Family:
    """The entry of a name. Raises TwinError with the nearest one."""
    for entry in families:
        if entry.name == name:
            return entry
    remedy = did_you_mean(name, [f.name for f in families], "families")
    raise TwinError(f"'{name}' is not in the catalogue", "--explain", remedy)


def with_own(path: Path) -> tuple[Family, ...]:
    """The catalogue with the entries of a user's file in front; an entry of an existing name takes its place.

    Raises TwinError for files that do not run or hold no FAMILIES.
    """
    scope: dict[str, object] = {"__name__": "own_catalogue", "__file__": str(path)}
    try:
        text = path.read_text("utf-8")
        exec(compile(text, str(path), "exec"), scope)
    except OSError as e:
        raise TwinError("cannot be read", str(path), "give a Python file that defines FAMILIES") from e
    except Exception as e:
        raise TwinError(
            f"does not run: {type(e).__name__}: {e}", str(path), "fix the file; see docs/diagnosis.md"
        ) from e
    own = scope.get("FAMILIES")
    if not isinstance(own, tuple) or not all(isinstance(f, Family) for f in own):
        raise TwinError("defines no tuple FAMILIES of Family", str(path), "see the example in docs/diagnosis.md")
    names = {f.name for f in own}
    return (*(replace(f, file=text) for f in own), *(f for f in FAMILIES if f.name not in names))


def explained(entry: Family) -> str:
    """An entry in words, for `--explain`."""
    rows = (
        ("what", entry.physics), ("adds", entry.operator), ("signature", entry.signature),
        ("worth naming", entry.smallest), ("sign", entry.sign), ("searched", entry.searched),
    )  # fmt: skip
    return "\n".join([f"{entry.number}. {entry.title} ({entry.name})", *(f"  {k:<13} {v}" for k, v in rows)])
