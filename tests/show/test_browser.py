"""The page of a description in a browser: drawn whole, clicked, slid; on a desk and on a telephone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.descriptions import SLIDE
from twin.face.show import show

FIVE_AXIS = Path(__file__).parents[2] / "models" / "five_axis"
CANVAS = "#machine-canvas"
MARKED = "document.querySelector('#groups button[aria-pressed=true]')?.textContent"


@pytest.fixture(scope="module")
def described(tmp_path_factory: pytest.TempPathFactory) -> str:
    return show(SLIDE, tmp_path_factory.mktemp("described") / "slide.html").path.as_uri()


@pytest.mark.parametrize(("width", "height"), [(1400, 900), (390, 844)])
def test_what_is_clicked_is_highlighted_and_told(described, shown, width, height):
    page = shown(width, height).open(described)
    assert page.colours(CANVAS) > 50
    assert page.do("document.documentElement.scrollWidth") <= width
    plain = page.pixels(CANVAS)
    page.do("() => [...document.querySelectorAll('#groups button')].find((b) => b.textContent === 'x_motor').click()")
    assert page.do(MARKED) == "x_motor"
    told = page.do("document.getElementById('chosen').textContent")
    assert all(words in told for words in ("block.x_min", "motor_copper", "0.5 ohm"))
    assert page.pixels(CANVAS) != plain
    page.do("document.getElementById('clear').click()")
    assert page.pixels(CANVAS) == plain
    page.slide("#axis-x", 0.2)
    assert page.pixels(CANVAS) != plain
    assert page.wrong == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in page.asked)


def test_a_click_on_the_machine_names_the_surface_there(described, shown):
    """A point of the plate's top, which lies above all, by its coordinates; also where an axis has moved it."""
    page = shown().open(described)
    for position in (0.0, 0.2):
        page.slide("#axis-x", position)
        x, y = page.do(f"""() => {{ const c = document.querySelector("{CANVAS}"), r = c.getBoundingClientRect();
            const p = new THREE.Vector3({0.03 + position}, 0.02, 0.23).project(page.machine.stage.camera);
            return [r.left + (p.x + 1) * c.clientWidth / 2, r.top + (1 - p.y) * c.clientHeight / 2]; }}""")
        page.tab.mouse.click(x, y)
        assert page.do(MARKED) == "plate.z_max"
        page.do("document.getElementById('clear').click()")
    page.tab.mouse.click(5 + page.tab.locator(CANVAS).bounding_box()["x"], y)
    assert page.do(MARKED) is None  # beside the machine
    assert page.wrong == []


def test_what_a_rotary_axis_carries_turns_about_it(shown, tmp_path):
    """A corner of the table's face is where two rotary axes and a linear one bring it, and is clicked there."""
    page = shown().open(show(FIVE_AXIS, tmp_path / "five_axis.html").path.as_uri())
    assert not [note for note in page.do("page.content.notes") if "turns nothing" in note]
    for axis, value in (("z", 0.2), ("b", 0.6), ("c", 0.8)):
        page.slide(f"#axis-{axis}", value)
    z, b, c = (float(page.do(f"document.getElementById('axis-{axis}').value")) for axis in "zbc")
    x, y = 0.25 * np.cos(0.3 + c), 0.25 * np.sin(0.3 + c)  # of the face, about its axis at y = 1.22 m
    depth = 1.0 - 1.1  # from the axis of the swivel, x = 0 and z = 1.1 m
    place = (x * np.cos(b) + depth * np.sin(b), 1.22 + y, 1.1 + depth * np.cos(b) - x * np.sin(b) + z)
    along = (np.sin(b), 0.0, np.cos(b))
    start = [float(p - 0.1 * a) for p, a in zip(place, along, strict=True)]
    seen = page.do(f"""() => {{ const m = page.machine, hit = m.hit({start}, {list(map(float, along))});
        return [m.told.names[hit.surface], hit.depth]; }}""")
    assert seen[0] == "table.top"
    assert seen[1] == pytest.approx(0.1, abs=1e-3)
    assert page.do("document.querySelector('#axis-b').nextSibling.textContent") == f"{np.rad2deg(b):.0f}°"
    assert page.wrong == []


def test_a_lumped_machine_is_a_network(shown, tmp_path):
    lathe = show(Path(__file__).parents[2] / "models" / "lathe", tmp_path / "lathe.html")
    page = shown().open(lathe.path.as_uri())
    assert page.do("document.querySelectorAll('#network .member').length") == 7
    page.do("document.querySelector('#network .member').dispatchEvent(new Event('click'))")
    assert page.do("document.querySelectorAll('#network .chosen').length") == 1
    assert page.do(MARKED) == page.do("page.content.network.names[0]")
    assert page.wrong == []
