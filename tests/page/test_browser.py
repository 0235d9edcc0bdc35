"""What a browser draws: nothing blank, nothing cut, nothing asked of others; on a desk and on a telephone."""

from __future__ import annotations

import pytest

from twin.page.finished import finished_told
from twin.page.front import write_page
from twin.rom.artefact import read_artefact

SIZES = [(1400, 900), (390, 844)]
CUT = """() => [...document.querySelectorAll(
        "h1, h2, p, li, label, output, figcaption, .ticks span, .legend span, td, th")]
    .filter((e) => e.offsetParent && !e.closest(".scroll"))
    .filter((e) => { const r = e.getBoundingClientRect(); return r.left < 0 || r.right > innerWidth + 0.5; })
    .map((e) => e.textContent)"""
NARROW = """() => [page.temperatures, page.time, page.alongChart].map((chart) => {
    const axis = chart.plot.axes[1], context = document.createElement("canvas").getContext("2d");
    context.font = "12px system-ui, sans-serif";
    const widest = Math.max(...axis._values.map((v) => context.measureText(v ?? "").width));
    return axis._size - 8 - widest; // 5 px of gap and a margin
})"""
NO_WEBGL = """
    const get = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
        return kind.startsWith("webgl") ? null : get.call(this, kind, ...more);
    };"""
APART = """() => [...document.querySelectorAll(".ticks")].map((bar) => {
    const all = [...bar.children].map((s) => s.getBoundingClientRect());
    return all.slice(1).every((r, k) => r.left >= all[k].right);
})"""


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_the_page_is_drawn_whole(frozen, shown, width, height):
    page = shown(width, height).open(frozen)
    page.do("() => new Promise((next) => setTimeout(next, 2000))")  # the four fields come when nothing else is to do
    assert page.colours("#surface-canvas") > 50
    assert page.colours("#workspace-canvas") > 20
    assert page.do("document.querySelectorAll('#fields canvas').length") == 4
    assert all(page.colours(f"#fields figure:nth-child({k}) canvas") > 50 for k in (1, 2, 3, 4))
    assert page.do("document.documentElement.scrollWidth") <= width
    assert page.do(CUT) == []
    assert min(page.do(NARROW)) >= 0.0
    assert all(page.do(APART))
    assert page.do("document.querySelectorAll('#certificate tbody tr').length") > 3
    assert page.wrong == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in page.asked)


def test_time_changes_colours_and_words(frozen, shown):
    page = shown().open(frozen)
    last = page.do("page.store.length - 1")
    page.slide("#time", last)
    end, shape, words = page.pixels("#surface-canvas"), page.pixels("#workspace-canvas"), page.do("page.range().low")
    page.slide("#time", 1)
    assert page.pixels("#surface-canvas") != end
    assert page.pixels("#workspace-canvas") != shape
    assert page.do("page.range().low") == words  # one scale for all times
    assert page.do("document.getElementById('now').textContent").startswith("after ")
    page.tab.select_option("#surface-span", "now")
    assert page.do("page.range().most") < page.do("page.surface.range(page.sampled(24), 'typical').most")
    assert page.wrong == []


def test_displacements_are_drawn_by_a_factor(frozen, shown):
    page = shown().open(frozen)
    usual = page.pixels("#surface-canvas")
    page.slide("#surface-scale", 0)
    assert page.do("document.getElementById('surface-factor').textContent") == "not at all"
    still = page.pixels("#surface-canvas")
    assert still != usual
    page.slide("#surface-scale", 50)
    assert page.pixels("#surface-canvas") == usual


def test_the_common_shift_is_told_and_can_be_drawn(frozen, shown):
    page = shown().open(frozen)
    alone = page.do("document.getElementById('workspace-words').textContent")
    assert alone.startswith("Common to all poses and not drawn: a shift of X ")
    page.tab.click("#workspace-shift")
    whole = page.do("document.getElementById('workspace-words').textContent")
    assert whole.startswith("The whole TCP error, up to ")
    assert page.do("page.high") > 0


def test_dragging_turns_the_machine(frozen, shown):
    page = shown().open(frozen)
    before = page.pixels("#surface-canvas")
    box = page.tab.locator("#surface-canvas").bounding_box()
    page.tab.mouse.move(box["x"] + 200, box["y"] + 200)
    page.tab.mouse.down()
    page.tab.mouse.move(box["x"] + 320, box["y"] + 230, steps=6)
    page.tab.mouse.up()
    assert page.pixels("#surface-canvas") != before
    page.tab.click("#surface-reset")
    assert page.pixels("#surface-canvas") == before


def test_one_hot_spot_takes_the_colours_from_nothing_else(frozen, shown):
    """One node at 90 degC: the rest keeps its range, and words tell of the spot."""
    page = shown().open(frozen)
    before = page.do("page.surface.computed([1], 'typical')")
    page.do("() => { const f = page.store.surface(1); f.temperature[0] = 90; page.store.surface = () => f; }")
    after = page.do("page.surface.computed([1], 'typical')")
    assert after["most"] == 90.0
    assert after["clipped"]
    assert after["high"] == pytest.approx(before["high"], abs=5.0)  # of 70 K; its nodes are few and large
    assert "the hottest 90.0 °C, on " in page.do("page.surface.words(page.surface.computed([1], 'typical'))")


@pytest.mark.parametrize("lacking", [("surface",), ("tcp",), ("surface", "tcp")])
def test_a_machine_that_lacks_something_is_drawn_without(slide_artefact, slide_result, tmp_path, shown, lacking):
    """Lumped machines have no surface, thermal problems no TCP."""
    told = finished_told(read_artefact(slide_artefact), slide_result)
    for name in lacking:
        told[name] = None
        told["machine"][{"tcp": "workspace"}.get(name, name)] = None
    write_page(tmp_path / "index.html", told)
    page = shown(390, 844).open((tmp_path / "index.html").as_uri())
    page.slide("#time", 2)
    for section, of in (("surface",) * 2, ("four", "surface"), ("workspace", "tcp"), ("tcp", "tcp"), ("along", "tcp")):
        assert page.do(f"document.getElementById('{section}').hidden") is (of in lacking)
    assert page.do("page.temperatures.plot.data[1].length") == page.do("page.store.length")
    assert page.wrong == []


def test_without_webgl_the_rest_is_drawn(frozen, shown):
    page = shown(script=NO_WEBGL).open(frozen)
    assert "no WebGL" in page.do("document.getElementById('surface').textContent")
    assert page.do("page.time.plot.data[1].length") == page.do("page.store.length")
    assert page.wrong == []
