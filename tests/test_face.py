"""The Python face: what `import twin` costs and offers, what its functions take and give back."""

from __future__ import annotations

import inspect
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import twin
from twin.cli.main import run as command
from twin.errors import ArtefactError, DescriptionError, LogError, TwinError

ROOT = Path(__file__).parents[1]
SPINDLE = ROOT / "tests" / "machines" / "spindle"
WARM_UP = SPINDLE / "runs" / "warm_up"
FUNCTIONS = (
    "load", "check", "build", "read", "simulate", "run", "score", "calibrate", "update", "rtest", "diagnose", "hide",
)  # fmt: skip
QUICK = twin.BuildOptions(held_out=2, hours=0.5)


@pytest.fixture(scope="module")
def model():
    return twin.build(SPINDLE, options=QUICK)


@pytest.fixture(scope="module")
def result(model):
    return model.run(WARM_UP)


def python(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def test_the_import_loads_nothing_heavy_and_no_package_of_ours():
    done = python(
        "import sys, twin; dir(twin)\n"
        "print({'numpy', 'jax', 'scipy', 'h5py', 'pint', 'click', 'matplotlib'} & set(sys.modules))\n"
        "print([m for m in sys.modules if m.startswith('twin.')])"
    )
    assert done.stdout.split("\n")[:2] == ["set()", "[]"], done.stdout + done.stderr


def test_every_function_is_listed_and_can_be_called():
    assert set(FUNCTIONS) <= set(dir(twin))
    for name in FUNCTIONS:
        assert callable(getattr(twin, name)), name
        assert ">>> import twin" in (getattr(twin, name).__doc__ or ""), name
        assert len(inspect.signature(getattr(twin, name)).parameters) <= 8, name


def test_what_editors_are_told_is_what_there_is():
    source = (ROOT / "twin" / "__init__.py").read_text(encoding="utf-8")
    told = {line.split(" as ")[-1].strip() for line in source.splitlines() if " import " in line and " as " in line}
    offered = {n for n in dir(twin) if not n.startswith("_") and not inspect.ismodule(getattr(twin, n))}
    offered |= {"build", "run", "calibrate", "diagnose", "export"}
    assert told <= offered
    assert all(getattr(twin, name) is not None for name in told)


@pytest.mark.long
def test_a_verb_stays_callable_once_its_package_is_imported():
    done = python(
        "import twin.build.pipeline, twin.run, twin\n"
        "from twin.build import pipeline\n"
        "assert callable(twin.build) and callable(twin.run) and twin.build.pipeline is pipeline\n"
        "assert 'machine' in __import__('inspect').signature(twin.build).parameters\n"
        "print(twin.run.__doc__.splitlines()[0])"
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Step a model through the loads of a run")


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="buidl"):
        twin.buidl


def test_objects_and_paths_give_the_same(model, result, tmp_path):
    saved = model.save(tmp_path / "a.h5")
    again = twin.run(str(tmp_path / "a.h5"), str(WARM_UP), tmp_path / "out")
    assert saved.artefact.digest == twin.read(tmp_path / "a.h5").artefact.digest == model.artefact.digest
    assert np.array_equal(again.numbers.tcp, result.numbers.tcp)
    assert (tmp_path / "out" / "result.h5").exists()


@pytest.mark.long
def test_a_saved_model_is_the_file_that_the_command_writes(tmp_path):
    assert command(["build", str(SPINDLE), "-o", str(tmp_path / "command.h5")]) == 0
    built = twin.read(tmp_path / "command.h5")
    built.save(tmp_path / "copy.h5")
    assert (tmp_path / "copy.h5").read_bytes() == (tmp_path / "command.h5").read_bytes()


def test_a_model_is_not_saved_over_other_files(model, tmp_path):
    (tmp_path / "notes.md").write_text("mine")
    with pytest.raises(TwinError, match="is no artefact"):
        model.save(tmp_path / "notes.md")
    with pytest.raises(TwinError, match="would replace an input"):
        model.save(tmp_path / "machine.toml")
    assert (tmp_path / "notes.md").read_text() == "mine"


def test_results_have_named_dimensions_and_units(result):
    pytest.importorskip("xarray")
    tcp = result.tcp
    assert tcp.dims == ("time", "x", "component")
    assert (tcp.attrs["units"], tcp.x.attrs["units"], tcp.time.attrs["units"]) == ("m", "m", "s")
    at = tcp.sel(x=0.1, component="z").values
    assert np.array_equal(at, result.numbers.tcp[:, 2, 2])
    front = result.temperatures.sel(sensor="front")
    assert front.attrs["units"] == "degC"
    assert np.array_equal(front.values, result.numbers.temperature[:, list(result.numbers.sensors).index("front")])
    assert result.heat.dims == ("step", "source")
    assert result.positions.sel(axis="x").shape == result.tcp_actual.sel(component="x").shape == (61,)


def test_without_xarray_the_remedy_is_named(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(TwinError, match=r"'xarray' is missing") as caught:
        result.tcp
    assert "twin[build]" in caught.value.problems[0].remedy


def test_pictures_are_shown_by_notebooks_as_they_are(result):
    for figure in (result.plot.temperatures(), result.plot.tcp(), result.plot.workspace(at="30 min")):
        assert figure._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(TwinError, match="no surface to draw"):
        result.plot.surface()


def test_the_workspace_is_drawn_at_the_time_asked_for(result):
    assert result.edge("30 min") == 30
    assert result.edge(1800.0) == 30
    worst = np.abs(result.numbers.tcp).max(axis=(1, 2))
    assert worst[result.edge(None)] == worst.max()
    assert "0.5 h" in result.plot.workspace(at="30 min").get_suptitle()


def test_a_run_goes_on_from_a_result(model, result):
    again = model.run(WARM_UP, initial=result)
    assert np.allclose(again.numbers.states[0], result.final_state, atol=1e-9)
    with pytest.raises(TwinError, match="no temperature"):
        model.run(WARM_UP, initial="20 K")


def test_errors_are_one_clear_line_and_never_an_exit(model, tmp_path):
    with pytest.raises(DescriptionError, match="no such file"):
        twin.load(tmp_path / "nowhere.toml")
    with pytest.raises(ArtefactError, match="no such file"):
        twin.read(tmp_path / "nowhere.h5")
    with pytest.raises(TwinError, match="dt"):
        model.run(WARM_UP, dt="60 m")
    with pytest.raises(TwinError, match="out of range"):
        model.run(WARM_UP, dt=-60.0)
    with pytest.raises(LogError, match="nothing measured"):
        twin.score(model, WARM_UP)
    with pytest.raises(TwinError, match="given twice"):
        twin.calibrate(model, [WARM_UP, WARM_UP])


def test_a_machine_that_changed_on_disk_is_not_built_from_memory(tmp_path):
    shutil.copy(SPINDLE / "machine.toml", tmp_path / "machine.toml")
    machine = twin.load(tmp_path)
    (tmp_path / "machine.toml").write_text(machine.text.replace('"14 W/K"', '"7 W/K"'), encoding="utf-8")
    with pytest.raises(DescriptionError, match="has changed since it was loaded"):
        twin.build(machine, options=QUICK)


def test_an_edited_machine_has_the_values_and_the_first_stays(tmp_path):
    machine = twin.load(SPINDLE)
    edited = machine.edited({"contacts.flange.total": 4.0}, tmp_path / "machine.toml")
    assert edited.parameters["contacts.flange.total"] == 4.0
    assert machine.parameters["contacts.flange.total"] == 8.0
    with pytest.raises(TwinError, match="would replace"):
        machine.edited({"contacts.flange.total": 4.0}, SPINDLE / "machine.toml")


@pytest.mark.long
def test_verifying_gives_a_certificate_with_the_full_model_only_where_asked(tmp_path):
    model = twin.build(SPINDLE, options=QUICK)
    assert model.certificate.passed
    assert model.verify(full=0, options=QUICK).certificate["full_scenarios"] == ()
    verified = model.verify(full=2, options=QUICK).certificate
    (rich,) = (part for part in verified["parts"] if part["name"] == "rich basis")
    assert max(rich["temperature_error_in_case"]) < 1e-9
    assert "rich against full" in str(verified)


def test_progress_is_reported_where_it_is_asked_for(model, capsys):
    model.run(WARM_UP, progress=False)
    assert capsys.readouterr() == ("", "")
    model.run(WARM_UP, progress=True)
    told = capsys.readouterr()
    assert "time steps" in told.err
    assert told.out == ""


def test_check_lists_mistakes_instead_of_raising(tmp_path):
    text = (SPINDLE / "machine.toml").read_text(encoding="utf-8")
    (tmp_path / "machine.toml").write_text(text.replace('area = "0.45 m^2"', 'area = "0.45 m"'), encoding="utf-8")
    findings = twin.check(tmp_path)
    assert not findings.ok
    assert "nodes.housing.area" in findings.problems[0].where
    assert twin.check(twin.load(SPINDLE)).ok


def test_a_simulated_run_names_the_machine_it_was_made_for(tmp_path):
    folder = tmp_path / "below" / "truth"
    simulated = twin.simulate(SPINDLE, WARM_UP, folder)
    assert (folder / simulated.machine).resolve() == SPINDLE / "machine.toml"
    assert not Path(simulated.machine).is_absolute()
    findings = twin.check(folder)
    assert findings.ok
    assert findings.facts["machine"] == "spindle"
