"""Which code a cache entry belongs to, on small packages and on this one."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from twin.build import import_closure as own
from twin.build.import_closure import ROOT, closure_hash, import_closure

FILES = {
    "__init__.py": 'def __getattr__(name):\n    from twin import outside\n    return outside\n\n\n__version__ = "1"\n',
    "first.py": "from twin import __version__, second\n",
    "second.py": "def f():\n    if f:\n        from twin.inner.third import VALUE\n    return VALUE\n",
    "inner/__init__.py": "",
    "inner/third.py": "import os.path\n\nimport numpy.linalg as la\n\nVALUE = 1\n",
    "types.py": "import typing\n\nif typing.TYPE_CHECKING:\n    import twin.outside\nelse:\n    from . import second\n",
    "caught.py": "try:\n    import skfem\nexcept ImportError:\n    from twin.inner import third\n",
    "outside.py": "import twin.first\n",
}


def package(folder: Path, edited: str = "") -> Path:
    for name, text in FILES.items():
        path = folder / "twin" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + ("# edited\n" if name == edited else ""))
    return folder


def test_a_closure_holds_what_is_imported_directly_and_through_others_and_nothing_else(tmp_path):
    found = import_closure("twin.first", package(tmp_path))
    assert found.modules == ("twin.first", "twin.inner", "twin.inner.third", "twin.second")
    assert found.others == ("numpy",)


def test_imports_for_type_checkers_do_not_count_but_relative_and_caught_ones_do(tmp_path):
    root = package(tmp_path)
    assert import_closure("twin.types", root).modules == ("twin.inner", "twin.inner.third", "twin.second", "twin.types")
    found = import_closure("twin.caught", root)
    assert "twin.inner.third" in found.modules
    assert found.others == ("numpy", "skfem")


@pytest.mark.parametrize(
    ("edited", "same"),
    [("inner/third.py", False), ("inner/__init__.py", False), ("first.py", False),
     ("outside.py", True), ("__init__.py", True)],
)  # fmt: skip
def test_the_hash_changes_with_the_closure_alone(tmp_path, edited, same):
    before = closure_hash("twin.first", package(tmp_path / "before"))
    assert (closure_hash("twin.first", package(tmp_path / "after", edited)) == before) == same


def test_the_hash_changes_with_the_version_of_a_library_that_is_imported(tmp_path, monkeypatch):
    root = package(tmp_path)
    before = closure_hash("twin.first", root)
    real = own.importlib.metadata.version
    for changed, same in (("scipy", True), ("numpy", False)):
        closure_hash.cache_clear()
        monkeypatch.setattr(own.importlib.metadata, "version", lambda name, c=changed: "0" if name == c else real(name))
        assert (closure_hash("twin.first", root) == before) == same


def test_a_module_that_is_not_there_is_an_error(tmp_path):
    with pytest.raises(ModuleNotFoundError, match="no module twin"):
        import_closure("twin.nothing", package(tmp_path))


@pytest.mark.long
def test_everything_that_python_imports_with_a_module_is_in_its_closure():
    module = "twin.diagnose.search.detector"
    show = f"import sys, {module}; print(*(m for m in sys.modules if m.startswith('twin.')))"
    done = subprocess.run([sys.executable, "-c", show], capture_output=True, text=True, check=True, cwd=ROOT)
    loaded = set(done.stdout.split())
    assert module in loaded
    assert loaded <= set(import_closure(module).modules)


def test_what_only_uses_thresholds_does_not_decide_about_them():
    closure = import_closure("twin.diagnose.search.detector").modules
    assert {
        "twin.diagnose.result.diagnosis",
        "twin.diagnose.evidence.batch",
        "twin.diagnose.model.probed_model",
        "twin.calibrate.fit.window",
    } <= set(closure)
    own = {name for name in closure if name.startswith("twin.diagnose.")}
    assert {name for name in own if name.startswith("twin.diagnose.search.")} == {"twin.diagnose.search.detector"}
    users = ("pipeline", "extend", "report", "plan")
    assert not [name for name in own if name.startswith(tuple(f"twin.diagnose.{user}" for user in users))]
    assert not [name for name in closure if name.startswith(("twin.cli", "twin.pictures", "twin.inject"))]


@pytest.mark.long
def test_an_edit_two_imports_away_in_this_package_is_a_miss(tmp_path):
    """twin.diagnose.search.detector -> twin.diagnose.model.probed_model -> twin.calibrate.fit.window."""
    hashes = {}
    for name, edited in (("as it is", None), ("in", "calibrate/fit/window.py"), ("out", "diagnose/search/verdict.py")):
        root = tmp_path / name
        shutil.copytree(ROOT / "twin", root / "twin", ignore=shutil.ignore_patterns("__pycache__"))
        if edited:
            path = root / "twin" / edited
            path.write_text(path.read_text() + "\n")
        hashes[name] = closure_hash("twin.diagnose.search.detector", root)
    assert hashes["as it is"] == hashes["out"] != hashes["in"]
    assert hashes["as it is"] == closure_hash("twin.diagnose.search.detector")
