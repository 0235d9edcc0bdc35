"""twin poses on the small machine."""

from __future__ import annotations

import json

import pytest

from tests.system.conftest import SLIDE
from twin.cli.main import run

SHORT = SLIDE / "runs" / "short"


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """The answer as JSON for two load cases."""
    from click.testing import CliRunner

    from twin.cli.poses import command

    done = CliRunner().invoke(
        command, [str(SLIDE), str(SHORT), "--at", "10 min", "--at", "0.5 h", "--steps", "30", "--json"],
        standalone_mode=False,
    )  # fmt: skip
    assert done.exception is None
    assert done.return_value == 0
    return json.loads(done.stdout)


def test_shares_of_each_load_case(told):
    assert [case["time_s"] for case in told["load_cases"]] == [600.0, 1800.0]
    for case in told["load_cases"]:
        assert case["max_tcp_error_m"] > 1e-6
        assert sum(case["shares"].values()) == pytest.approx(1.0, abs=1e-12)
        assert case["shares"]["shift"] > 0.5


def test_more_poses_interpolate_better(told):
    assert told["axes"] == ["x"]
    errors = {g["poses"]: g["max_m"]["linear"] for g in told["grids"]}
    assert list(errors) == [2, 3, 4, 5, 6, 7]
    assert errors[7] < errors[3] < told["case_m"]
    for grid in told["grids"]:
        assert grid["p95_m"]["lagrange"] <= grid["max_m"]["lagrange"]


def test_smallest_grid_keeps_the_tolerance_and_the_next_smaller_does_not(told, capsys):
    errors = {g["poses"]: g["max_m"]["linear"] for g in told["grids"]}
    between = 1e6 * (errors[3] + errors[4]) / 2
    assert errors[4] < errors[3]
    arguments = ["poses", str(SLIDE), str(SHORT), "--at", "10 min", "--at", "0.5 h", "--steps", "30"]
    assert run([*arguments, "--tolerance", f"{between} um"]) == 0
    out = capsys.readouterr().out
    (line,) = [row for row in out.splitlines() if row.startswith("linear interpolation within")]
    assert line.endswith("um: 4 = 4 poses")
    assert run([*arguments, "--tolerance", "1e-6 um"]) == 1
    assert "no grid of those tried" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--tolerance", "1 K"), "--tolerance"),
        (("--tolerance", "0 um"), "--tolerance"),
        (("--at", "5 h"), "the log covers 0.5 h, not 5 h"),
        (("--at", "noon"), "--at"),
        (("--most", "1"), "--most"),
    ],
)
def test_bad_options_are_refused(option, said, capsys):
    assert run(["poses", str(SLIDE), str(SHORT), *option]) == 2
    assert said in capsys.readouterr().err
