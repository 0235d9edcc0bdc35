"""What runs beside the machine imports without the workstation's packages, and the command line starts light."""

import subprocess
import sys

import pytest

WORKSHOP = (
    "skfem",
    "meshio",
    "gmsh",
    "pydantic",
    "tomlkit",
    "pypardiso",
    "pyamg",
    "sksparse",
    "matplotlib",
    "starlette",
    "uvicorn",
)
BLOCK = f"""
import importlib, pkgutil, sys
class Workshop:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] in {WORKSHOP}:
            raise ImportError(f'{{name}} is not at the edge')
sys.meta_path.insert(0, Workshop())
"""


def python(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


PACKAGES = (
    "twin.run",
    "twin.rom",
    "twin.logs",
    "twin.physics",
    "twin.calibrate",
    "twin.live",
    "twin.page",
    "twin.face",
)


@pytest.mark.long
@pytest.mark.parametrize("package", PACKAGES)
def test_every_module_of_the_edge_imports_without_the_workshop(package):
    done = python(
        BLOCK + f"package = importlib.import_module({package!r})\n"
        "names = [m.name for m in pkgutil.walk_packages(package.__path__, package.__name__ + '.')]\n"
        "[importlib.import_module(n) for n in names]\n"
        "print(len(names))"
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 0


def test_the_blocker_blocks():
    assert "not at the edge" in python(BLOCK + "import skfem").stderr


@pytest.mark.parametrize("command", ["run", "live", "serve", "info", "score", "calibrate", "update", "rtest"])
def test_edge_commands_show_their_help_without_the_workshop(command):
    done = python(BLOCK + f"from twin.cli.main import run\nsys.exit(run([{command!r}, '--help']))")
    assert done.returncode == 0, done.stderr
    assert "Example" in done.stdout


def test_the_list_of_commands_needs_neither_numpy_nor_jax():
    done = python(
        "import sys\nfrom twin.cli.main import run\nstatus = run(['--help'])\n"
        "heavy = {'numpy', 'jax', 'scipy', 'pint', 'h5py'} & set(sys.modules)\nprint(heavy)\n"
        "sys.exit(status or len(heavy))"
    )
    assert done.returncode == 0, done.stdout + done.stderr
