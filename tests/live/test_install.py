"""What it takes to install the process beside a machine: the systemd unit, the container file, wheels."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import sys
from importlib import resources
from pathlib import Path

import pytest

from twin.cli.main import run
from twin.live.install.unit import unit_of

ROOT = Path(__file__).parents[2]
RUN = ROOT / "tests" / "machines" / "spindle" / "runs" / "warm_up"
GIVEN = ["out/my machine.h5", "--source", "mqtt:broker/loads%1", "--out", "file:out/$now.json", "--state", "out/live"]


def test_the_unit_says_the_command_as_it_was_given(capsys):
    assert run(["live", *GIVEN, "--engine", "jax", "--print-unit"]) == 0
    told = capsys.readouterr().out
    line = next(line for line in told.splitlines() if line.startswith("ExecStart="))
    words = shlex.split(line.removeprefix("ExecStart="))
    assert words[0] == sys.executable
    assert words[4:] == [a.replace("%", "%%").replace("$", "$$") for a in [*GIVEN, "--engine", "jax"]]
    assert f"WorkingDirectory={Path.cwd()}" in told
    assert "MemoryMax=1G" in told
    assert "@" not in told


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd")
def test_systemd_finds_nothing_wrong_with_the_unit(tmp_path):
    path = tmp_path / "twin-live.service"
    path.write_text(unit_of(GIVEN, "c"))
    done = subprocess.run(["systemd-analyze", "verify", str(path)], capture_output=True, text=True, check=False)
    about = [line for line in (done.stdout + done.stderr).splitlines() if "twin-live" in line]
    assert about == []
    path.write_text(unit_of(GIVEN, "c").replace("ExecStart=", "ExecStrt="))
    wrong = subprocess.run(["systemd-analyze", "verify", str(path)], capture_output=True, text=True, check=False)
    assert "twin-live" in wrong.stdout + wrong.stderr


def container_steps() -> list[tuple[str, str]]:
    text = (resources.files("twin.live.install") / "Containerfile").read_text(encoding="utf-8")
    lines = [line for line in text.replace("\\\n", " ").splitlines() if line.strip() and not line.startswith("#")]
    return [(word, rest.strip()) for word, _, rest in (line.partition(" ") for line in lines)]


def test_the_container_file_installs_what_the_wheelhouse_makes():
    steps = container_steps()
    assert [word for word, _ in steps] == ["ARG", "FROM", "RUN", "RUN", "STOPSIGNAL", "ENTRYPOINT"]
    install = steps[3][1]
    assert re.search(r"^WHEELS \?= out/wheelhouse$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)
    assert "source=out/wheelhouse,target=/wheels" in install
    assert "--find-links /wheels 'twin[live,mqtt]'" in install
    extras = re.findall(r"^(\w+) = \[", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M)
    assert {"live", "mqtt"} <= set(extras)


NEITHER = """
import sys
class Nothing:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] in ('jax', 'jaxlib', 'numpy', 'scipy', 'h5py', 'pint', 'asyncua', 'paho'):
            raise ImportError(f'{name} is not installed')
sys.meta_path.insert(0, Nothing())
from twin.cli.main import run
sys.exit(run(sys.argv[1:]))
"""


def without_packages(*arguments: str) -> subprocess.CompletedProcess[str]:
    """`twin` where only click is installed."""
    return subprocess.run([sys.executable, "-c", NEITHER, *arguments], capture_output=True, text=True, check=False,
                          timeout=120)  # fmt: skip


@pytest.mark.long
def test_a_compiled_machine_runs_without_jax_and_numpy_to_the_same_numbers(spindle, compiled, tmp_path):
    given = ["--source", f"replay:{RUN}", "--speed", "0", "--out", f"file:{tmp_path / 'now.json'}"]
    shutil.copytree(compiled, tmp_path / "a" / "engine")
    assert run(["live", str(spindle), *given, "--state", str(tmp_path / "a")]) == 0
    (machine,) = compiled.iterdir()
    carried = tmp_path / "mill"
    shutil.copytree(machine, carried)
    done = without_packages("live", str(carried), *given, "--state", str(tmp_path / "b"))
    assert done.returncode == 0, done.stderr
    one, other = ((tmp_path / s / "step.json").read_text() for s in "ab")
    assert json.loads(one) == json.loads(other)
    assert json.loads(one)["step"] >= 5


@pytest.mark.long
def test_what_is_no_compiled_machine_is_refused(spindle, compiled, tmp_path, capsys):
    given = ["--source", f"csv:{tmp_path / 'x.csv'}", "--out", f"file:{tmp_path / 'now.json'}"]
    state = ["--state", str(tmp_path / "state")]
    assert run(["live", str(tmp_path), *given, *state]) == 2
    assert "a folder without a compiled machine" in capsys.readouterr().err
    (machine,) = compiled.iterdir()
    assert run(["live", str(machine), *given, *state, "--engine", "jax"]) == 2
    assert "runs in C alone" in capsys.readouterr().err
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("x")
    command = [sys.executable, "-m", "twin.live.prepare", str(spindle), str(tmp_path / "mine")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "holds no compiled machine" in done.stderr
    assert (tmp_path / "mine" / "thesis.txt").is_file()


BARE = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin"}


@pytest.fixture(scope="module")
def wheels(tmp_path_factory) -> Path:
    """What `make wheelhouse` makes; needs a package index."""
    folder = tmp_path_factory.mktemp("wheels")
    command = ["make", "-o", f"{sys.prefix}/.ready", f"VENV={sys.prefix}", f"WHEELS={folder}", "wheelhouse"]
    made = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    if made.returncode:
        pytest.skip(f"no wheels to be had: {made.stderr[-200:]}")
    return folder


def installed(venv: Path, wheels: Path, *what: str) -> Path:
    """The Python of a new environment with this, and nothing of a network."""
    subprocess.run([sys.executable, "-m", "venv", str(venv)], check=True)
    python = venv / "bin" / "python"
    subprocess.run([str(python), "-m", "pip", "install", "-q", "--no-index", "--find-links", str(wheels), *what],
                   check=True, env=BARE)  # fmt: skip
    return python


@pytest.mark.slow
def test_wheels_install_and_run_without_a_network(wheels, spindle, tmp_path):
    python = installed(tmp_path / "all", wheels, "twin[live,mqtt]")
    twin = str(python.parent / "twin")
    given = ["--source", f"replay:{RUN}", "--speed", "0", "--out", "file:now.json", "--state"]

    def ran(*command: str) -> None:
        subprocess.run(command, check=True, cwd=tmp_path, env=BARE)

    ran(twin, "live", str(spindle), *given, "state-c", "--engine", "c")
    ran(twin, "live", str(spindle), *given, "state-jax", "--engine", "jax")
    ran(str(python), "-c", "import twin.live.mqtt, twin.live.opcua, paho.mqtt, asyncua")
    ran(str(python), "-m", "twin.live.prepare", str(spindle), "mill")
    alone = installed(tmp_path / "alone", wheels, "--no-deps", "twin", "click")
    ran(str(alone.parent / "twin"), "live", "mill", *given, "alone")
    command = [str(alone.parent / "twin"), "live", str(spindle), *given, "x"]
    told = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=BARE)
    assert told.returncode == 2
    assert "compile it where JAX is" in told.stderr
    one, other = (json.loads((tmp_path / s / "step.json").read_text()) for s in ("state-c", "alone"))
    assert one["states"] == other["states"]


@pytest.mark.slow
@pytest.mark.skipif(not (shutil.which("buildah") and shutil.which("debootstrap")), reason="no buildah, no debootstrap")
def test_the_container_is_built_and_runs(wheels, spindle, tmp_path):
    """On a base that debootstrap makes of the same Debian: an image of a registry would have to be fetched."""
    if sys.version_info[:2] != (3, 11):
        pytest.skip("Debian 12 has Python 3.11")
    base = tmp_path / "base"
    told = ["debootstrap", "--variant=minbase", "bookworm", str(base)]
    if subprocess.run(told, capture_output=True, check=False).returncode:
        pytest.skip("no Debian to be had")
    shutil.copytree(wheels, tmp_path / "context" / "out" / "wheelhouse")
    file = tmp_path / "context" / "Containerfile"
    file.write_text((resources.files("twin.live.install") / "Containerfile").read_text(encoding="utf-8"))
    store = ["buildah", "--storage-driver", "vfs", "--root", str(tmp_path / "store"), "--runroot", str(tmp_path / "r")]

    def buildah(*arguments: str) -> str:
        done = subprocess.run([*store, *arguments], capture_output=True, text=True, check=False, cwd=tmp_path)
        assert done.returncode == 0, done.stderr[-1000:]
        return done.stdout.strip()

    (tmp_path / "Base").write_text("FROM scratch\nADD base /\n")
    buildah("bud", "--isolation", "chroot", "-f", "Base", "-t", "base", ".")
    buildah("bud", "--isolation", "chroot", "--pull-never", "--build-arg", "BASE=localhost/base", "-f", str(file),
            "-t", "twin-live", str(file.parent))  # fmt: skip
    entry = json.loads(buildah("inspect", "--type", "image", "twin-live"))["OCIv1"]["config"]["Entrypoint"]
    shutil.copytree(RUN, tmp_path / "srv" / "run")
    shutil.copy(spindle, tmp_path / "srv" / "a.h5")
    container = buildah("from", "--pull-never", "twin-live")
    told = buildah("run", "--isolation", "chroot", "-v", f"{tmp_path / 'srv'}:/srv/twin", container, "--", *entry,
                   "/srv/twin/a.h5", "--source", "replay:/srv/twin/run", "--speed", "0", "--out",
                   "file:/srv/twin/now.json", "--state", "/srv/twin/state")  # fmt: skip
    assert re.search(r" [1-9]\d* steps, ", told)
