"""Single axis errors: chains, homogeneous transformations, their linear form, rank, planted errors that come back."""

from __future__ import annotations

import itertools
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from twin.calibrate.axis_errors.chain import Chain, chain_of, parse_chain
from twin.calibrate.axis_errors.errors import Ranges, axis_errors, design_matrix, effect_size, rigid_motion
from twin.calibrate.axis_errors.field import field_shares
from twin.calibrate.axis_errors.fit import AxisErrorFit, fit_axis_errors, rows_needed
from twin.calibrate.axis_errors.htm import measured_displacement
from twin.calibrate.axis_errors.rtest_plan import Plan, rtest_plan
from twin.errors import LogError, ModelError, TwinError
from twin.rom.load_model import AxisWiring, Pair, Rail

FIVE_AXIS = parse_chain("w-C-B-Z-b-X-Y-t")
CENTRE = {"Y": -0.06, "Z": -0.55}
NOISE = 1e-6  # m
NEVER = {"EAY", "EBY", "ECY", "EBX"}  # a tool of one length on Y on X


def planted(chain: Chain, rng: np.random.Generator, size: float = 1.0) -> dict[str, float]:
    """20 um and 50 urad, as a warm machine has."""
    return {e.name: size * rng.normal() * (20e-6 if e.unit == "m" else 50e-6) for e in axis_errors(chain)}


def htm_by_hand(ranges: Ranges, e: dict[str, float], plan: Plan, offset: np.ndarray, rigid: np.ndarray) -> np.ndarray:
    """E-000-5 for w-C-B-Z-b-X-Y-t written out: tool minus workpiece, -T_t^-1 T_w p_ball (n, 3) [m].

    Written apart from the package, one pose at a time, with rotations by SciPy. rigid: shift [m] and tilt [rad].
    """

    def frame(turn: Rotation, shift: np.ndarray) -> np.ndarray:
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), shift
        return matrix

    def screw(axis: str, t: float) -> np.ndarray:
        powers = [1 if d == axis else 2 for d in "XYZ"]
        shift = np.array([e[f"E{d}{axis}"] * t**p for d, p in zip("XYZ", powers, strict=True)])
        return frame(Rotation.from_euler("xyz", [e[f"E{d}{axis}"] * t for d in "ABC"]), shift)

    still = Rotation.identity()
    told = []
    for k, row in enumerate(plan.position):
        y, x, z = (v - ranges.centre[a] for v, a in zip(row, "YXZ", strict=True))
        y_axis = Rotation.from_euler("z", e["C0Y"]).apply([0.0, 1.0, 0.0])
        z_axis = Rotation.from_euler("xy", [e["A0Z"], e["B0Z"]]).apply([0.0, 0.0, 1.0])
        tool = frame(still, [x, 0, 0]) @ screw("X", x / ranges.half["X"])
        tool = tool @ frame(still, y * y_axis) @ screw("Y", y / ranges.half["Y"])
        work = screw("Z", z / ranges.half["Z"]) @ frame(still, z * z_axis)
        work = work @ np.linalg.inv(frame(Rotation.from_euler("xyz", rigid[3:]), rigid[:3]))
        turned = Rotation.from_euler("y", plan.angle["B"][k]) * Rotation.from_euler("z", plan.angle["C"][k])
        ball = np.array([x, y, -z]) + turned.apply(offset[plan.ball[k]])
        told.append(-(np.linalg.inv(tool) @ work @ np.append(ball, 1.0))[:3])
    return np.array(told)


def balls_of(plan: Plan) -> list[np.ndarray]:
    """What an offset of each ball does, from the plan's angles."""
    turned = Rotation.from_euler("YZ", np.column_stack([plan.angle["B"], plan.angle["C"]]))
    return [np.where((plan.ball == k)[:, None, None], -turned.as_matrix(), 0.0) for k in np.unique(plan.ball)]


def fit_of(plan: Plan, displacement: np.ndarray, sigma: float | None = NOISE, unknown: bool = False) -> AxisErrorFit:
    ranges = Ranges.of(plan.chain, plan.position)
    spread = None if sigma is None else np.full(len(plan.time), sigma)
    return fit_axis_errors(
        plan.chain, ranges, plan.position, displacement, spread, balls_of(plan) if unknown else ()
    )  # fmt: skip


def pulls(fit: AxisErrorFit, truth: dict[str, float]) -> np.ndarray:
    known = fit.determined
    values = np.array([truth[n] for n in fit.names])
    return (fit.value[known] - values[known]) / fit.sigma[known]


def test_chain_is_read_from_tool_to_workpiece():
    chain = parse_chain("w-C'-B-X-Z'-b-Y-t")
    assert [(a.letter, a.side, a.sense) for a in chain.linear] == [("Y", 1, 1), ("Z", -1, -1), ("X", -1, 1)]
    assert [(a.letter, a.sense) for a in chain.rotary] == [("B", 1), ("C", -1)]
    assert str(chain) == "w-C'-B-X-Z'-b-Y-t"
    assert str(FIVE_AXIS) == "w-C-B-Z-b-X-Y-t"


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("X-Y-Z", "no kinematic chain"),
        ("w-X-Y-t", "no kinematic chain"),
        ("w-b-X-Q-t", "no kinematic chain"),
        ("", "no kinematic chain"),
        ("w-X-b-X-t", "stands twice"),
        ("w-C-b-t", "no linear axis"),
        ("w-Z-b-X-Y-C-t", "rotary axis carries"),
        ("w-Z-C-b-X-Y-t", "rotary axis carries"),
    ],
)
def test_bad_chains_say_what_to_write(text, what):
    with pytest.raises(ModelError, match=what) as e:
        parse_chain(text)
    assert e.value.problems[0].remedy


@pytest.mark.parametrize("rail_moves", [False, True])
def test_chain_of_an_artefact(rail_moves):
    """Order and sides from the wiring and the description of the five-axis machine, whichever side the rails lie on."""
    axes = tuple(AxisWiring(a, tuple(np.eye(3)[k]), -0.4, 0.4, f"{a}_position") for k, a in enumerate("xyz"))
    joined = [("bed", "column"), ("column", "headstock"), ("bed", "carriage")]  # standing, moving
    bodies = {name: SimpleNamespace(name=name, ports=[]) for pair in joined for name in pair}
    rails, pairs = [], []
    for k, (standing, moving) in enumerate(joined):
        rail, pad = (moving, standing) if rail_moves else (standing, moving)
        bodies[rail].ports.append(2 * k)
        bodies[pad].ports.append(2 * k + 1)
        rails.append(Rail(f"rail_{k}", 2 * k, (0.0,)))
        pairs.append(Pair(f"guide_{k}", k, k, 2 * k + 1, 0.0, rail_moves, 1e-3, 1.0))
    load = SimpleNamespace(axes=axes, rails=rails, pairs=pairs)
    description = (Path(__file__).parents[2] / "models" / "five_axis" / "machine.toml").read_text(encoding="utf-8")
    artefact = SimpleNamespace(
        model=SimpleNamespace(load_model=load, bodies=tuple(bodies.values()), structure=None), description=description
    )
    assert chain_of(artefact) == FIVE_AXIS
    load.axes = (AxisWiring("x", (-1.0, 0.0, 0.0), -0.4, 0.4, "x"), *axes[1:])
    assert str(chain_of(artefact)) == "w-C-B-Z-b-X'-Y-t"
    load.axes = (AxisWiring("x", (0.8, 0.6, 0.0), -0.4, 0.4, "x"), *axes[1:])
    with pytest.raises(ModelError, match="along its coordinate"):
        chain_of(artefact)


def test_names_are_those_of_iso_230():
    names = [e.name for e in axis_errors(FIVE_AXIS)]
    assert len(names) == len(set(names)) == 21
    assert names[:6] == ["EXX", "EYX", "EZX", "EAX", "EBX", "ECX"]
    assert names[18:] == ["C0Y", "B0Z", "A0Z"]
    assert [e.name for e in axis_errors(parse_chain("w-b-Y-Z-t"))][12:] == ["A0Z"]
    assert len(axis_errors(parse_chain("w-b-X-t"))) == 6


@pytest.mark.parametrize("kind", ["indexed", "circles"])
def test_transformations_agree_with_eq_9_written_out(kind):
    plan = rtest_plan(FIVE_AXIS, kind, centre=CENTRE)
    ranges = Ranges.of(FIVE_AXIS, plan.position)
    rng = np.random.default_rng(1)
    errors = planted(FIVE_AXIS, rng, size=100.0)  # milliradians: nothing small is left out
    offset, rigid = 1e-3 * rng.normal(size=(2, 3)), np.append(1e-3 * rng.normal(size=3), 2e-3 * rng.normal(size=3))
    ours = measured_displacement(
        FIVE_AXIS, ranges, errors, plan.position, plan.angle, offset[plan.ball], rigid[:3], rigid[3:]
    )
    np.testing.assert_allclose(ours, htm_by_hand(ranges, errors, plan, offset, rigid), atol=1e-15)
    assert np.abs(ours).max() > 1e-3


def test_without_errors_the_probe_reads_zero():
    plan = rtest_plan(FIVE_AXIS, centre=CENTRE)
    ranges = Ranges.of(FIVE_AXIS, plan.position)
    np.testing.assert_allclose(measured_displacement(FIVE_AXIS, ranges, {}, plan.position), 0.0, atol=1e-16)
    with pytest.raises(KeyError, match="EXQ"):
        measured_displacement(FIVE_AXIS, ranges, {"EXQ": 1.0}, plan.position)


CHAINS = [
    "-".join(["w", *order[:bed], "b", *order[bed:], "t"]) for order in itertools.permutations("XYZ") for bed in range(4)
]


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(CHAINS), st.integers(0, 2**31), st.sampled_from([1, -1]))
def test_linear_form_is_the_derivative_of_the_transformations(text, seed, sense):
    """Every error by central differences, and the sum of all of them misses to second order only."""
    chain = parse_chain(text.replace("Z", "Z'") if sense < 0 else text)
    rng = np.random.default_rng(seed)
    position = rng.uniform(-0.5, 0.5, (12, 3))
    ranges = Ranges.of(chain, position)
    linear = design_matrix(chain, ranges, position)
    h = 1e-5
    for k, error in enumerate(axis_errors(chain)):
        plus, minus = (measured_displacement(chain, ranges, {error.name: s * h}, position) for s in (1, -1))
        np.testing.assert_allclose((plus - minus) / (2 * h), linear[:, :, k], atol=1e-8)
    rigid = rigid_motion(chain, ranges, position)
    for k, unit in enumerate(np.eye(3)):
        told = measured_displacement(chain, ranges, {}, position, shift=h * unit)
        np.testing.assert_allclose(told, h * rigid[:, :, k], atol=1e-15)
        told = measured_displacement(chain, ranges, {}, position, tilt=h * unit)
        np.testing.assert_allclose(told, h * rigid[:, :, 3 + k], atol=3e-10)


@pytest.mark.parametrize("text", CHAINS)
def test_four_errors_never_show_with_one_tool(text):
    """Full volume, every chain: all three rotations of the axis next to the tool, and of the one before it the rotation
    about that axis."""
    chain = parse_chain(text)
    grid = np.stack(np.meshgrid(*[np.linspace(-0.4, 0.4, 4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    fit = fit_axis_errors(chain, Ranges.of(chain, grid), grid, np.zeros((64, 3)), np.full(64, NOISE))
    first, second = chain.linear[0].letter, chain.linear[1].letter
    about = "ABC"["XYZ".index(first)]
    assert fit.rank == fit.determined.sum() == 17
    assert {str(c) for c in fit.hidden} == {f"E{r}{first}" for r in "ABC"} | {f"E{about}{second}"}


def test_fifteen_of_21_come_back_and_the_other_six_are_named(capsys):
    """All 21, shift and tilt planted in exact transformations written apart; 20 seeds."""
    plan = rtest_plan(FIVE_AXIS, "indexed", centre=CENTRE)
    ranges = Ranges.of(FIVE_AXIS, plan.position)
    hidden = NEVER | {"EXY", "EZY"}
    every = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        errors = planted(FIVE_AXIS, rng)
        rigid = np.append(20e-6 * rng.normal(size=3), 50e-6 * rng.normal(size=3))
        exact = htm_by_hand(ranges, errors, plan, np.zeros((2, 3)), rigid)
        fit = fit_of(plan, exact + NOISE * rng.normal(size=exact.shape))
        assert fit.rank == fit.determined.sum() == 15
        assert {str(c) for c in fit.hidden} == hidden == {n for n in fit.names if n not in fit.values()}
        assert np.isnan(fit.value[~fit.determined]).all()
        assert not fit.misfit
        every.append(pulls(fit, errors))
        assert np.abs((fit.tilt - rigid[3:]) / fit.tilt_sigma).max() < 4.0
    all_pulls = np.concatenate(every)
    within = float((np.abs(all_pulls) < 2.0).mean())
    with capsys.disabled():
        print(f"\n  15 of 21, 20 seeds: {100 * within:.1f} % within 2 sigma, pulls of rms {all_pulls.std():.2f}")
    assert 0.92 < within < 0.985  # 95.4 % of 300
    assert 0.9 < np.sqrt(np.mean(all_pulls**2)) < 1.1
    assert np.abs(np.mean(every, axis=0)).max() < 4.0 / np.sqrt(20)  # no error is off to one side


def test_hidden_errors_do_leave_the_readings_as_they_are():
    """Not a matter of the linear form: 100 um and 250 urad of each, in exact transformations."""
    plan = rtest_plan(FIVE_AXIS, "indexed", centre=CENTRE)
    ranges = Ranges.of(FIVE_AXIS, plan.position)
    calm = htm_by_hand(
        ranges, dict.fromkeys([e.name for e in axis_errors(FIVE_AXIS)], 0.0), plan, np.zeros((2, 3)), np.zeros(6)
    )
    for error in axis_errors(FIVE_AXIS):
        value = 100e-6 if error.unit == "m" else 250e-6
        errors = {e.name: value * (e.name == error.name) for e in axis_errors(FIVE_AXIS)}
        change = htm_by_hand(ranges, errors, plan, np.zeros((2, 3)), np.zeros(6)) - calm
        change = change - change.mean(axis=0)  # a shift is not an error of an axis
        if error.name in NEVER | {"EXY", "EZY"}:
            assert np.abs(change).max() < 0.05e-6, error.name
        else:
            assert np.abs(change).max() > 2e-6, error.name


def test_full_circles_show_17():
    plan = rtest_plan(FIVE_AXIS, "circles", centre=CENTRE)
    ranges = Ranges.of(FIVE_AXIS, plan.position)
    rng = np.random.default_rng(5)
    errors = planted(FIVE_AXIS, rng)
    exact = htm_by_hand(ranges, errors, plan, np.zeros((2, 3)), np.zeros(6))
    fit = fit_of(plan, exact + NOISE * rng.normal(size=exact.shape))
    assert fit.rank == 17
    assert {str(c) for c in fit.hidden} == NEVER
    assert np.abs(pulls(fit, errors)).max() < 4.0


def test_unknown_places_of_the_balls_hide_the_common_scale():
    """The machine is its own ruler then: an even growth of X, Y, Z looks like balls further out. Their ratios show."""
    plan = rtest_plan(FIVE_AXIS, "circles", centre=CENTRE)
    ranges = Ranges.of(FIVE_AXIS, plan.position)
    size = dict(zip([e.name for e in axis_errors(FIVE_AXIS)], effect_size(FIVE_AXIS, ranges), strict=True))
    found = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        errors = planted(FIVE_AXIS, rng)
        exact = htm_by_hand(ranges, errors, plan, 200e-6 * rng.normal(size=(2, 3)), np.zeros(6))
        noisy = exact + NOISE * rng.normal(size=exact.shape)
        fit = fit_of(plan, noisy, unknown=True)
        assert fit.rank == 16
        assert {n for n in fit.names if n not in fit.values()} == NEVER | {"EXX", "EYY", "EZZ"}
        (scale,) = [c.weights for c in fit.hidden if len(c.weights) > 1]
        per_metre = [scale[f"E{a}{a}"] / ranges.half[a] for a in "XYZ"]
        np.testing.assert_allclose(per_metre, per_metre[0], rtol=1e-3)  # the same growth per metre
        assert len(fit.visible) == 2
        for c in fit.visible:
            truth = sum(w * size[n] * errors[n] for n, w in c.weights.items())
            found.append((c.value - truth) / c.sigma)
        found += pulls(fit, errors).tolist()
        assert fit_of(plan, noisy).misfit  # taking the places as known is found out
    assert 0.9 < np.sqrt(np.mean(np.square(found))) < 1.1


def test_rank_does_not_hang_on_rounded_positions():
    """Positions as a control stands: 20 um off those planned. Y's parabola is then felt, and not believed."""
    plan = rtest_plan(FIVE_AXIS, "indexed", centre=CENTRE)
    rng = np.random.default_rng(2)
    position = plan.position + 20e-6 * rng.normal(size=plan.position.shape)
    fit = fit_axis_errors(FIVE_AXIS, Ranges.of(FIVE_AXIS, position), position, np.zeros(position.shape))
    assert fit.rank == 15
    assert {n for n in fit.names if n not in fit.values()} == NEVER | {"EXY", "EZY"}


def test_misfit_is_told_and_noise_is_not():
    plan = rtest_plan(FIVE_AXIS, "circles", centre=CENTRE)
    ranges = Ranges.of(FIVE_AXIS, plan.position)
    t = (plan.position[:, 1] - ranges.centre["X"]) / ranges.half["X"]
    wave = 6e-6 * np.sin(4.0 * t)[:, None] * [1.0, 0.0, 0.0]  # the screw's pitch error
    alarms = 0
    for seed in range(20):
        noise = NOISE * np.random.default_rng(seed).normal(size=wave.shape)
        alarms += fit_of(plan, noise).misfit
        bent = fit_of(plan, wave + noise)
        assert bent.misfit
        assert bent.sigma[0] > 1.2 * fit_of(plan, noise).sigma[0]  # widened
    assert alarms <= 1
    told = fit_of(plan, noise, sigma=None)
    assert not told.misfit
    assert told.noise == pytest.approx(NOISE, rel=0.2)


def test_rows_of_different_weight():
    """Ten times the noise in half of the rows: sigmas follow."""
    plan = rtest_plan(FIVE_AXIS, "circles", centre=CENTRE)
    ranges = Ranges.of(FIVE_AXIS, plan.position)
    sigma = np.where(np.arange(len(plan.time)) % 2, NOISE, 10 * NOISE)
    every = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        errors = planted(FIVE_AXIS, rng)
        exact = measured_displacement(FIVE_AXIS, ranges, errors, plan.position)
        noisy = exact + sigma[:, None] * rng.normal(size=exact.shape)
        every.append(pulls(fit_axis_errors(FIVE_AXIS, ranges, plan.position, noisy, sigma), errors))
    assert 0.9 < np.sqrt(np.mean(np.square(every))) < 1.1


def test_an_axis_that_stands_still_shows_nothing():
    rng = np.random.default_rng(0)
    position = rng.uniform(-0.3, 0.3, (40, 3))
    position[:, 2] = 0.1 + 1e-6 * rng.normal(size=40)  # Z: encoder noise
    fit = fit_axis_errors(FIVE_AXIS, Ranges.of(FIVE_AXIS, position), position, np.zeros((40, 3)), np.full(40, NOISE))
    assert not any(name[2] == "Z" for name in fit.values())
    assert {"EXX", "EYY", "EAX", "C0Y"} <= set(fit.values())


def test_two_axes_and_one():
    chain = parse_chain("w-b-Y-Z-t")
    rng = np.random.default_rng(0)
    position = rng.uniform([0.0, 0.0], [1.8, 0.4], (30, 2))
    ranges = Ranges.of(chain, position)
    errors = planted(chain, rng)
    fit = fit_axis_errors(
        chain, ranges, position, measured_displacement(chain, ranges, errors, position), np.full(30, NOISE)
    )
    assert fit.determined.sum() == fit.rank
    for name, value in fit.values().items():
        assert value == pytest.approx(errors[name], abs=0.5e-6), name
    one = parse_chain("w-b-X-t")
    x = np.linspace(-0.35, 0.35, 9)[:, None]
    fit = fit_axis_errors(one, Ranges.of(one, x), x, np.outer(x, [30e-6, 0.0, 0.0]))
    assert fit.values()["EXX"] == pytest.approx(30e-6 * 0.35)
    assert set(fit.values()) == {"EXX", "EYX", "EZX"}
    assert np.isnan(fit.tilt[0])  # about the only axis
    assert fit.tilt[1:] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_too_few_rows_are_refused_with_their_number():
    plan = rtest_plan(FIVE_AXIS, centre=CENTRE)
    assert rows_needed(FIVE_AXIS) == 10
    for rows in (0, 1, 9):
        with pytest.raises(LogError, match=f"{rows} rows, where 10 are needed"):
            fit_axis_errors(
                FIVE_AXIS, Ranges.of(FIVE_AXIS, plan.position), plan.position[:rows], np.zeros((rows, 3))
            )  # fmt: skip


def test_shares_of_a_volume():
    chain = FIVE_AXIS
    grid = np.stack(np.meshgrid(*[np.linspace(-0.4, 0.4, 5)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    ranges = Ranges.of(chain, grid)
    rng = np.random.default_rng(0)
    errors = planted(chain, rng)
    only = measured_displacement(chain, ranges, errors, grid)
    shares = field_shares(chain, grid, only)
    assert shares.rest < 1e-6
    assert shares.largest_rest < 0.05e-6
    shifted = field_shares(chain, grid, np.broadcast_to([3e-5, 0.0, 1e-5], grid.shape))
    assert shifted.shift == pytest.approx(1.0)
    tilted = field_shares(chain, grid, measured_displacement(chain, ranges, {}, grid, tilt=np.array([0.0, 1e-5, 2e-5])))
    assert tilted.tilt == pytest.approx(1.0, abs=1e-6)
    mixed = field_shares(chain, grid, only + 1e-5 * np.sin(12.0 * grid[:, [1, 2, 0]]) * np.cos(9.0 * grid))
    assert mixed.shift + mixed.tilt + mixed.axis_errors + mixed.rest == pytest.approx(1.0)
    assert min(mixed.shift, mixed.tilt, mixed.axis_errors, mixed.rest) >= 0.0
    assert mixed.rest > 0.01
    assert np.isnan(field_shares(chain, grid, np.zeros(grid.shape)).shift)


TURN = [(0, c) for c in range(0, 360, 30)]  # B, C in degrees
SWEEP = [(b, 0) for b in range(-30, 31, 10)]
INDEXED = [(b, c) for c in (0, 180) for b in range(-30, 31, 10)]
ASIDE = [(b, c) for b in (-90, 90) for c in range(0, 360, 30)]
ONE, STANDS = [(0.1, 0.1, -0.3)], [(0.1, 0.1, -0.3), (0.1, 0.1, -0.42)]
RADII = [(0.1, 0.0, -0.3), (0.2, 0.0, -0.3)]
OF_Z = {"EXZ", "EYZ", "EZZ", "EAZ", "EBZ", "ECZ", "B0Z", "A0Z"}


@pytest.mark.parametrize(
    ("balls", "angles", "known", "unknown", "never"),
    [
        (ONE, TURN, (8, 7), (7, 5), {"EZX", "EZY"} | OF_Z),
        (STANDS, TURN, (14, 13), (11, 9), {"EZX", "EZY", "EXZ", "EYZ"}),
        (ONE, INDEXED, (14, 12), (12, 9), {"EXY", "EZY", "EYX", "EYZ", "A0Z"}),
        (STANDS, INDEXED, (15, 15), (13, 12), {"EXY", "EZY"}),
        (RADII, ASIDE, (15, 15), (13, 12), {"EYX", "EZX"}),
        (STANDS, TURN + SWEEP, (17, 17), (16, 14), set()),
    ],
)
def test_plans_determine_as_many_errors_as_documented(balls, angles, known, unknown, never):
    """The table of docs/axis_errors.md: rank and number of determined errors, places of the balls known and not."""
    turned = Rotation.from_euler("YZ", np.array(angles), degrees=True)
    ball = np.repeat(np.arange(len(balls)), len(angles))
    point = np.vstack([turned.apply(b) for b in balls])
    position = np.column_stack([point[:, 1], point[:, 0], -point[:, 2]])  # Y, X, Z follow
    frames = np.tile(turned.as_matrix(), (len(balls), 1, 1))
    offsets = [np.where((ball == k)[:, None, None], -frames, 0.0) for k in range(len(balls))]
    ranges = Ranges.of(FIVE_AXIS, position)
    for wanted, blocks in ((known, []), (unknown, offsets)):
        fit = fit_axis_errors(FIVE_AXIS, ranges, position, np.zeros(position.shape), None, blocks)
        assert (fit.rank, fit.determined.sum()) == wanted
        assert len(fit.hidden) == 21 - fit.rank
        assert len(fit.visible) == fit.rank - fit.determined.sum()
        if blocks == []:
            assert {n for n in fit.names if n not in fit.values()} == NEVER | never


def test_plans_need_their_kind_of_machine():
    for text in ("w-b-X-Y-Z-t", "w-C-Z-b-X-t"):
        with pytest.raises(TwinError, match="no plan"):
            rtest_plan(parse_chain(text))
    trunnion = rtest_plan(parse_chain("w-C-A-Y-b-X-Z-t"), stands=(0.1, 0.2))
    assert set(trunnion.angle) == {"A", "C"}
    fit = fit_of_plain(trunnion)
    assert fit.rank == 15


def fit_of_plain(plan: Plan) -> AxisErrorFit:
    return fit_axis_errors(
        plan.chain, Ranges.of(plan.chain, plan.position), plan.position, np.zeros((len(plan.time), 3))
    )  # fmt: skip
