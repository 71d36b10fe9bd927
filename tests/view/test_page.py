"""The page of the window in a real browser: what it shows is what Python computes (make test-browser)."""

from __future__ import annotations

import json
from urllib.parse import quote, unquote

import numpy as np
import pytest

import fluorspar
from devtools import opened_page
from fluorspar import SpectralImage, Wavelengths, compare
from fluorspar.colour.xyz import lab_from_xyz, white_xyz, xyz_from_radiance
from fluorspar.image.components import COMPONENTS
from fluorspar.image.display.appearance import appearance
from fluorspar.measuring.regions import measure_regions
from fluorspar.view import sources
from fluorspar.view.opening import opened
from fluorspar.view.server import Server
from fluorspar.view.sources import ImageSource
from fluorspar.view.supplies import Supplies
from fluorspar.view.workspace import Workspace

pytestmark = pytest.mark.browser

SIZE = 32
LAMP, WALL, BLOCK = (16, 4), (3, 16), (12, 22)
CANVAS = """[...document.querySelector('#picture').toDataURL()].reduce(
    (hash, letter) => (31 * hash + letter.charCodeAt(0)) % 4294967291, 7)"""
PLAIN = {"lights": {}, "materials": {}, "concentration": {}}


@pytest.fixture(scope="module")
def paths():
    return fluorspar.trace("cornell-box", size=(SIZE, SIZE), spp=8)


@pytest.fixture(scope="module")
def dim(paths):
    """The same scene with half of the light and another dye."""
    return paths.image(lights={"light": 0.5}, materials={"left-wall": "poster-orange"})


@pytest.fixture(scope="module")
def address(paths, dim, tmp_path_factory):
    folder = tmp_path_factory.mktemp("view")
    paths.save(folder / "box.paths")
    dim.save(folder / "dim.nc")
    supplies = Supplies()
    sources = opened([str(folder / "box.paths"), str(folder / "dim.nc")], supplies)
    with Server(Workspace(sources, supplies)) as server:
        yield server.address


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with opened_page(tmp_path_factory.mktemp("profile")) as page:
        page.size(1280, 720)
        yield page


@pytest.fixture
def page(browser, address):
    """The page as it opens; nothing in it may have failed in the end."""
    browser.troubles.clear()
    browser.prefer("light")
    browser.open(address)
    settled(browser)
    yield browser
    assert browser.troubles == []


def settled(page):
    """Wait until the picture is there and nothing is being asked."""
    page.wait(
        "document.querySelector('.cover')?.hidden && !document.querySelector('#status .working').textContent"
    )


def picture(page):
    """What the canvas shows, as a number that no other picture has."""
    page.value("new Promise(requestAnimationFrame)")
    return page.value(CANVAS)


def changed(page, before):
    """The canvas, as soon as it is another and stays so."""
    page.wait(f"{CANVAS} !== {before}")
    settled(page)
    return picture(page)


def place(page, pixel):
    """Where a pixel of the picture is on the screen."""
    left, top, width, height = page.value(
        "(({left, top, width, height}) => [left, top, width, height])"
        "(document.querySelector('#picture').getBoundingClientRect())"
    )
    scale = float(page.value("document.querySelector('.zoom').textContent").split()[0])
    at = [low + round((room - SIZE * scale) / 2) for low, room in ((left, width), (top, height))]
    return tuple(start + (p + 0.5) * scale for start, p in zip(at, pixel, strict=True))


def numbers(page, column=0):
    """The table of the pins: its rows in one column, as text."""
    page.wait("document.querySelector('.numbers-table tbody td') !== null")
    rows = (
        "Object.fromEntries([...document.querySelectorAll('.numbers-table tr[data-row]')]"
        f".map((row) => [row.dataset.row, row.querySelectorAll('td')[{column}].textContent]))"
    )
    return page.value(rows)


def view(page):
    """The state that the address bar tells of."""
    page.value("new Promise((done) => setTimeout(done, 400))")
    text = page.value("location.hash")
    return json.loads(unquote(text[1:])) if text else {}


def xyz_at(image, pixel):
    spectra = measure_regions(image, {"pin": (*pixel, *pixel)})
    return xyz_from_radiance(spectra.at("pin"), image.wavelengths)


def assert_shows(rows, xyz):
    """The table has four digits of XYZ, and four decimals of x and y."""
    np.testing.assert_allclose([float(rows[name]) for name in "XYZ"], xyz, rtol=6e-4)
    np.testing.assert_allclose([float(rows[name]) for name in "xy"], xyz[:2] / xyz.sum(), atol=6e-5)


def test_a_click_shows_the_numbers_of_python(page, paths):
    page.click(place(page, WALL))
    image = paths.image()
    rows = numbers(page)
    assert_shows(rows, xyz_at(image, WALL))
    luminescent = measure_regions(image, {"pin": (*WALL, *WALL)}, component="luminescent").luminance()[0]
    assert float(rows["Luminescent"].removesuffix(" %")) == pytest.approx(
        100 * luminescent / float(rows["Y"]), abs=0.1
    )
    assert view(page)["pins"] == [{"region": [*WALL, *WALL]}]


def test_a_region_is_drawn_and_a_second_pin_stands_beside_it(page, paths):
    page.click("[aria-label='Drag draws a region']")
    page.drag(place(page, (20, 8)), place(page, (22, 10)), place(page, (23, 11)))
    numbers(page)
    page.click(place(page, BLOCK), ctrl=True)
    page.wait("document.querySelectorAll('.numbers-table tr[data-row=X] td').length === 2")
    spectra = measure_regions(paths.image(), {"wall": (20, 8, 23, 11)})
    assert_shows(numbers(page), xyz_from_radiance(spectra.at("wall"), spectra.grid))
    assert_shows(numbers(page, 1), xyz_at(paths.image(), BLOCK))


def test_relative_to_the_first_pin(page):
    """A pin relative to itself is 1 at all wavelengths, and its L* is that of white."""
    page.click(place(page, WALL))
    numbers(page)
    page.value("document.querySelector('.options label:nth-child(2) input').click()")
    page.wait("document.querySelector('tr[data-row=\"L*\"] td').textContent === '100.00'")


def test_a_component_is_switched_off_and_undone(page):
    before = picture(page)
    page.click("[data-name=source] .icon")
    off = changed(page, before)
    assert view(page)["view"]["weights"] == {"source": 0}
    page.mouse("mouseMoved", *place(page, LAMP))
    page.wait("document.querySelector('#readout').textContent.includes('cd/m²')")
    page.key("z", ctrl=True)
    assert changed(page, off) == before
    page.key("z", ctrl=True, shift=True)
    assert changed(page, before) == off


def test_a_lamp_and_a_dye_are_changed(page, paths):
    page.click("[role=tab]:nth-child(3)")
    before = picture(page)
    page.choose("[data-light=light] select", {"name": "A"})
    lamp = changed(page, before)
    page.click("[data-surface=left-wall] summary")
    page.click("[data-surface=left-wall] [data-value=poster-orange]")
    changed(page, lamp)
    page.click(place(page, WALL))
    relight = view(page)["view"]["relight"]
    assert relight["materials"] == {"left-wall": "poster-orange"}
    assert relight["lights"] == {"light": {"factor": 1, "spectrum": {"name": "A"}}}
    image = paths.image(lights={"light": "A"}, materials={"left-wall": "poster-orange"})
    assert_shows(numbers(page), xyz_at(image, WALL))


def test_a_spectrum_is_drawn_by_hand(page):
    page.click("[role=tab]:nth-child(3)")
    before = picture(page)
    page.choose("[data-light=light] select", "curve")
    page.wait("document.querySelector('.drawing').checkVisibility()")
    settled(page)
    drawn = picture(page)
    x, y = page.place(".drawn")
    page.drag((x - 150, y + 45), (x + 60, y + 45), (x + 150, y - 40))
    assert changed(page, drawn) != before
    knots = view(page)["view"]["relight"]["lights"]["light"]["spectrum"]["curve"]
    values = dict(map(tuple, knots))
    assert values[400] < 0.15
    assert values[690] > 0.5
    page.key("z", ctrl=True)
    page.key("z", ctrl=True)
    page.wait(f"{CANVAS} === {before}")


def test_pictures_are_coarse_while_a_slider_is_dragged(page):
    """One request at a time; the last one is not coarse."""
    page.click("[role=tab]:nth-child(3)")
    page.value(
        """(() => {
        const send = window.fetch;
        window.asked = {now: 0, most: 0, coarse: []};
        window.fetch = async (address, options) => {
            if (!address.endsWith("api/picture")) return send(address, options);
            asked.now += 1;
            asked.most = Math.max(asked.most, asked.now);
            asked.coarse.push(JSON.parse(options.body).coarse);
            try { return await send(address, options); } finally { asked.now -= 1; }
        };
        })()"""
    )
    x, y = page.place("[data-light=light] input[type=range]")
    page.drag((x, y), *((x + step, y) for step in range(4, 60, 4)), release=False)
    page.wait("asked.coarse.length > 0 && asked.now === 0")
    page.mouse("mouseReleased", x + 56, y, button="left", clickCount=1)
    page.wait("asked.coarse.at(-1) === false && asked.now === 0")
    assert page.value("asked.most") == 1
    assert page.value("asked.coarse.slice(0, -1).every(Boolean)")
    assert view(page)["view"]["relight"]["lights"]["light"]["factor"] > 1


def test_two_images_are_compared(page, paths, dim):
    before = picture(page)
    other = {"name": "dim.nc", "source": "1", "relight": PLAIN, "weights": {}}
    page.choose("[aria-label='Compare with']", other)
    page.wait("document.querySelector('#strip .numbers').textContent.includes('mean')")
    slider = changed(page, before)
    said = page.value("document.querySelector('#strip .numbers').textContent").split()
    expected = compare(paths.image(), dim).images.as_dict()["de00_mean"]
    assert float(said[said.index("mean") + 1]) == pytest.approx(expected, rel=0.01)
    page.drag(page.place(".split"), (300, 300), (200, 300))
    moved = changed(page, slider)
    page.click("#strip [data-value=map]")
    assert changed(page, moved) not in (before, slider)


def test_b_is_seen_as_a_is(page, paths, dim):
    """At its exposure, by an eye adapted to its light, which an image does not know; also its L*a*b*."""
    other = {"name": "dim.nc", "source": "1", "relight": PLAIN, "weights": {}}
    page.choose("[aria-label='White balance']", {"light": "light"})
    page.choose("[aria-label='Compare with']", other)
    page.wait("document.querySelector('#strip .numbers').textContent.includes('mean')")
    page.click(place(page, WALL))
    page.wait("document.querySelectorAll('.numbers-table thead th').length === 3")
    settled(page)
    a, b = (float(numbers(page, column)["L*"]) for column in (0, 1))
    white = white_xyz(paths.job.scene.lights[0].spectrum.on(dim.wavelengths), dim.wavelengths)
    exposure = appearance(paths.image().dataset, COMPONENTS, white=white).exposure
    x, y = WALL
    for lightness, image in ((a, paths.image()), (b, dim)):
        xyz = xyz_from_radiance(image.total().values[y, x], image.wavelengths)
        assert lightness == pytest.approx(lab_from_xyz(xyz, white / white[1] / exposure)[0], abs=0.02)
    assert page.value("document.querySelector('.over-picture').hidden")


def test_numbers_of_another_view_do_not_stay(page):
    """A region that is not there leaves no older numbers below its name, and can be taken away."""
    page.click(place(page, WALL))
    numbers(page)
    pins = quote(json.dumps({"panel": "spectrum", "pins": [{"region": [0, 0, 99, 99]}]}))
    page.value(f"location.hash = '#{pins}'")
    page.wait("document.querySelector('#panel .fault:not([hidden])') !== null")
    assert page.value("document.querySelector('.numbers-table').checkVisibility()") is False
    assert "region 0, 0 to 99, 99" in page.value(
        "document.querySelector('#panel .fault:not([hidden])').innerText"
    )
    page.click("[aria-label='Remove pin 1']")
    page.wait("document.querySelector('.empty').checkVisibility()")
    page.troubles.clear()  # what was refused


def test_a_band_in_false_colour(page, paths):
    page.click("[data-value=band]")
    page.wait("document.querySelector('.bar').ariaLabel?.includes('W m')")
    fields = "[...document.querySelectorAll('.band input')].map((field) => Number(field.value))"
    low, high = page.value(fields)
    assert (low, high) == (540, 560)
    page.value("document.querySelector('.band-handle.middle').focus()")
    page.key("ArrowRight")
    assert page.value(fields) == [545, 565]
    page.click("[data-value=relative_error]")
    page.wait("document.querySelector('.colour-bar .unit').textContent === 'of the radiance'")
    assert page.value("document.querySelector('.colour-bar .number').value") != ""


def test_infrared_is_shown_as_bands(browser):
    """In colour it would be black, and says so; the band to begin with is in its middle."""
    grid = Wavelengths(900, 1000, 10)
    image = ImageSource("nir.hdr", SpectralImage.from_arrays(np.ones((7, 4, 6, len(grid))), grid))
    with Server(Workspace([image])) as server:
        browser.open(server.address)
        browser.wait(
            "document.querySelector('.over-picture')?.innerText.includes('wavelength of this image is visible')"
        )
        browser.click("[data-value=band]")
        browser.wait("document.querySelector('.over-picture').hidden")
        fields = "[...document.querySelectorAll('.band input')].map((field) => Number(field.value))"
        assert browser.value(fields) == [940, 960]


def test_an_image_of_another_size_is_seen_whole(browser):
    """However far somebody had moved into the one before."""
    grid = Wavelengths(400, 700, 20)
    sizes = {"small.nc": (6, 8), "large.nc": (600, 800)}
    images = [
        ImageSource(name, SpectralImage.from_arrays(np.ones((7, *size, len(grid)), np.float32), grid))
        for name, size in sizes.items()
    ]
    with Server(Workspace(images)) as server:
        browser.open(server.address)
        settled(browser)
        browser.key("+")
        browser.choose("#toolbar [aria-label=Image]", "1")
        browser.wait("document.title.startsWith('large')")
        browser.wait("parseFloat(document.querySelector('.zoom').textContent) < 2")


def test_dark_and_light(page):
    page.value("document.body.append(Object.assign(document.createElement('i')))")
    for scheme, dark in (("dark", True), ("light", False)):
        page.prefer(scheme)
        page.value("new Promise((done) => setTimeout(done, 300))")
        assert (page.shot()[90:700, 1275].mean() < 128) == dark
    page.click("[aria-label='Light or dark']")
    page.value("new Promise((done) => setTimeout(done, 300))")
    assert page.shot()[90:700, 1275].mean() < 128
    page.value("localStorage.clear()")


def test_the_keyboard_suffices(page, paths):
    """A pixel is pinned, the mode changed, the list of keys opened and closed, a tab reached: no pointer."""
    page.key("p")
    for _ in range(4):
        page.key("ArrowLeft")
    page.key("ArrowDown", shift=True)
    page.key("Enter")
    assert_shows(numbers(page), xyz_at(paths.image(), (12, 26)))
    page.key("2")
    page.wait("document.querySelector('[data-value=band]').ariaChecked === 'true'")
    page.key("?")
    page.wait("document.querySelector('dialog[open]') !== null")
    page.key("Escape")
    page.wait("document.querySelector('dialog') === null")
    reached = set()
    for _ in range(60):
        page.key("Tab")
        name = "(({ariaLabel, textContent, id}) => ariaLabel || textContent || id)(document.activeElement)"
        reached.add(page.value(name))
        focus = "getComputedStyle(document.activeElement).outlineStyle"
        assert page.value(f"document.activeElement === document.body || {focus} !== 'none'")
    assert {"Undo", "Keyboard and mouse", "Spectrum", "Compare with", "Picture"} <= reached


def test_the_address_keeps_the_view(page, address):
    page.click(place(page, WALL))
    page.key("g")
    page.key("E", shift=True)
    state = view(page)
    assert state["view"]["gamut"] is True
    page.open(address + "#" + quote(json.dumps(state)))
    numbers(page)
    settled(page)
    assert view(page) == state
    page.open(address + "#nonsense")
    page.wait("document.querySelector('.toast')?.textContent.includes('left out')")
    settled(page)


@pytest.mark.parametrize("size", [(1280, 720), (1440, 900)])
def test_everything_has_its_place(page, size):
    """The page does not scroll, and nothing in the toolbar or the panel covers another or runs out of its row."""
    page.size(*size)
    try:
        page.click(place(page, WALL))
        for tab in range(1, 6):
            page.click(f"[role=tab]:nth-child({tab})")
            page.value("new Promise((done) => setTimeout(done, 300))")
            assert page.value("document.documentElement.scrollHeight <= innerHeight && scrollY === 0")
            wide = "[...document.querySelectorAll('.page:not([hidden])')].every((p) => p.scrollWidth <= p.clientWidth)"
            assert page.value(wide), tab
        overlaps = """[...document.querySelectorAll('.row, .tools:not([hidden]), .tabs, footer')].flatMap((row) => {
            const boxes = [...row.children].map((child) => child.getBoundingClientRect()).filter((box) => box.width);
            const covers = (box, last) => box.left < last.right - 0.5 && box.top < last.bottom - 0.5;
            const clash = boxes.some((box, i) => i && covers(box, boxes[i - 1]));
            return clash || boxes.some((box) => box.right > innerWidth + 0.5) ? [row.className] : [];
        })"""
        for mode in ("relative_error", "band", "colour"):
            page.click(f"[data-value={mode}]")
            settled(page)
            assert page.value(overlaps) == []
        shot = page.shot()[82:-28, : size[0] - 420].astype(int)
        assert (np.ptp(shot, axis=2) > 30).mean() > 0.1  # the picture fills the stage
    finally:
        page.size(1280, 720)


def test_the_words_of_the_server_stand_where_they_belong(page):
    page.click("[role=tab]:nth-child(3)")
    page.choose("[data-light=light] select", "curve")
    page.wait("document.querySelector('.drawing').checkVisibility()")
    page.value(
        "[...document.querySelectorAll('.drawing button')].find((b) => b.textContent === 'Clear').click()"
    )
    page.wait("document.querySelector('[data-light=light] .fault').textContent.length > 10")
    page.key("z", ctrl=True)
    page.wait("document.querySelector('[data-light=light] .fault').hidden")
    settled(page)
    page.troubles.clear()  # the browser notes refused requests as errors


def test_a_spectrum_is_uploaded(page, tmp_path):
    lamp, broken = tmp_path / "my-lamp.csv", tmp_path / "broken.csv"
    lamp.write_text("wavelength,value\n300,0\n400,0\n500,0.3\n600,1\n700,1\n800,0\n")
    broken.write_text("no spectrum")
    page.click("[role=tab]:nth-child(3)")
    before = picture(page)
    page.upload(lambda: page.choose("[data-light=light] select", "a file"), lamp)
    changed(page, before)
    chosen = "document.querySelector('[data-light=light] select').selectedOptions[0].textContent"
    assert page.value(chosen) == "my-lamp.csv"
    page.upload(lambda: page.choose("[data-light=light] select", "a file"), broken)
    page.wait("document.querySelector('[data-light=light] .fault').textContent.includes('broken.csv')")
    assert page.value(chosen) == "my-lamp.csv"
    page.troubles.clear()  # the browser notes refused requests as errors


def test_a_picked_pixel_is_white(page, paths):
    before = picture(page)
    page.choose("[aria-label='White balance']", "pick")
    page.click(place(page, WALL))
    changed(page, before)
    np.testing.assert_allclose(view(page)["view"]["white"], xyz_at(paths.image(), WALL), rtol=1e-5)
    assert "pins" not in view(page)
    page.wait(
        "(([r, g, b]) => Math.max(r, g, b) - Math.min(r, g, b) <= 2)"
        "(document.querySelector('#readout').textContent.match(/sRGB (\\d+) (\\d+) (\\d+)/).slice(1))"
    )


def test_every_control_has_a_name(page):
    page.click(place(page, WALL))
    page.choose("[aria-label='Compare with']", "keep")
    controls = {
        "button",
        "slider",
        "spinbutton",
        "combobox",
        "checkbox",
        "radio",
        "tab",
        "textbox",
        "searchbox",
    }
    for tab in range(1, 6):
        page.click(f"[role=tab]:nth-child({tab})")
        settled(page)
        nodes = page.send("Accessibility.getFullAXTree")["nodes"]
        found = [node for node in nodes if node.get("role", {}).get("value") in controls]
        assert len(found) > 20
        assert all(node["name"]["value"] for node in found if not node.get("ignored"))


def test_a_scene_is_traced_while_one_looks(browser, tmp_path):
    supplies = Supplies()
    sources = opened(["cornell-box"], supplies, size=(SIZE, SIZE), spp=32, wavelengths="400:700:20")
    with Server(Workspace(sources, supplies)) as server:
        browser.open(server.address)
        settled(browser)
        browser.click(place(browser, WALL))
        image = fluorspar.render("cornell-box", size=(SIZE, SIZE), spp=32, wavelengths="400:700:20")
        y = xyz_at(image, WALL)[1]
        browser.wait(f"Math.abs(document.querySelector('tr[data-row=Y] td')?.textContent / {y} - 1) < 6e-4")
        assert browser.troubles == []


def test_what_is_saved_is_the_image(page, paths):
    page.click("[role=tab]:nth-child(4)")
    page.wait("document.querySelector('.command').textContent.startsWith('fluorspar ')")
    stored = page.value(
        """new Promise((done) => {
        URL.createObjectURL = (blob) => { blob.slice(0, 4).text().then(done); return "about:blank"; };
        HTMLAnchorElement.prototype.click = () => {};
        document.querySelector('[data-format=nc]').click();
        })"""
    )
    assert stored.endswith("HDF")


def test_it_says_when_the_server_is_gone(browser, dim, tmp_path):
    dim.save(tmp_path / "dim.nc")
    supplies = Supplies()
    with Server(Workspace(opened([str(tmp_path / "dim.nc")], supplies), supplies)) as server:
        browser.open(server.address)
        settled(browser)
    browser.key("g")
    browser.wait("document.querySelector('#status').textContent.includes('does not answer')")
    browser.troubles.clear()


def test_a_large_image_shows_all_pixels_of_what_one_zooms_into(page, dim, monkeypatch):
    """Of 32 x 32 pixels 8 x 8 are shown at first; zoomed in, the picture is that of a window that has them all."""
    state = quote(json.dumps({"view": {"source": "0", "exposure": 0.005}}))

    def opened_at(server):
        page.open(f"{server.address}#{state}")
        settled(page)
        return picture(page)

    with Server(Workspace([ImageSource("dim", dim)])) as server:
        whole = opened_at(server)
        for _ in range(3):
            page.key("+")
        part = changed(page, whole)
    monkeypatch.setattr(sources, "_LARGE", 31)
    monkeypatch.setattr(sources, "_OVERVIEW", 8)
    with Server(Workspace([ImageSource("dim", dim)])) as server:
        assert opened_at(server) != whole
        for _ in range(3):
            page.key("+")
        page.wait(f"{CANVAS} === {part}")
