# SPDX-License-Identifier: GPL-3.0-or-later
"""The page that turns, in browsers, by WebGL and by WebGPU: its points are those of `sinew points`, its heat
maps those of docs/metrics.md; keys and controls do what they say; it fits on small screens; faults of Flex
are found.

SINEW_PICTURES  a folder for pictures, to look at
"""

import itertools
import os
from pathlib import Path

import browsers
import numpy as np
import pytest
import read_page

KEYS_ARE_NAMED = """
return [...document.querySelectorAll("button, input, select, canvas")].filter((one) =>
  !(one.labels && one.labels.length) && !one.getAttribute("aria-label") && !one.textContent.trim()).length
"""
# What is drawn, red, green, blue and opacity for each pixel.
PIXELS = """(() => {
  const { width, height } = document.getElementById("view");
  // Text that wraps once it is written changes it.
  window.sinew.height_drawn = height;
  window.sinew.draw(IS_SMOOTH);
  const copy = Object.assign(document.createElement("canvas"), { width, height }).getContext("2d");
  copy.drawImage(document.getElementById("view"), 0, 0);
  return copy.getImageData(0, 0, width, height).data;
})()"""

# The middle of the mark of what is chosen, from that of the view, in pixels.
MARKED = """
const boxes = ["mark-0", "view"].map((id) => document.getElementById(id).getBoundingClientRect());
const [mark, view] = boxes.map((box) => [box.x + box.width / 2, box.y + box.height / 2]);
return [mark[0] - view[0], mark[1] - view[1]]
"""
IS_MARKED = f"(() => {{{MARKED}}})().every((x) => Math.abs(x) < 2)"
# Drags the handle of the wipe to a quarter of the width.
# By the page itself: what Firefox's scripts for tests set on its objects, it does not see.
DRAG = """
const script = document.createElement("script");
script.textContent = `{
  const handle = document.getElementById("wipe");
  const { left, width } = document.getElementById("stage").getBoundingClientRect();
  handle.hasPointerCapture = () => true;
  handle.setPointerCapture = () => {};
  for (const [name, share] of [["pointerdown", 0.52], ["pointermove", 0.25], ["pointerup", 0.25]]) {
    const at = { clientX: left + share * width, pointerId: 1, bubbles: true };
    handle.dispatchEvent(new PointerEvent(name, at));
  }
}`;
document.head.append(script);
"""
DRAWS = "document.getElementById('notes').lastChild.textContent"
VIEW = "const { yaw, pitch, zoom, offset } = window.sinew.state; return [yaw, pitch, zoom, ...offset]"


@pytest.fixture(params=["webgl", "webgpu"], autouse=True)
def way(request, browser):
    browser.way = request.param


def pixels(browser, is_smooth="false"):
    """float32 [height, width, 4], colours times opacity, 0 to 255"""
    found = browser.floats(PIXELS.replace("IS_SMOOTH", is_smooth))
    found = found.reshape(browser.run("return window.sinew.height_drawn"), -1, 4).copy()
    found[:, :, :3] *= found[:, :, 3:] / 255
    return found


def points(browser, *arguments):
    return browser.floats(f"window.sinew.points({', '.join(map(str, arguments))})").reshape(-1, 4)[:, :3]


@pytest.mark.parametrize("name", ["wrist", "mix", "staged", "keyed", "shoulder", "human"])
def test_points_are_those_of_sinew(browser, made, name):
    if name not in made:
        pytest.skip("human.blend is in no folder SINEW_RIGS")
    page = made[name]
    browser.show(page.page)
    header, _meshes = read_page.read(page.page)
    for method, expected in page.points.items():
        for frame, shape in zip(page.frames, expected, strict=True):
            found = points(browser, 0, f"'{method}'", header["frames"].index(frame))
            diagonal = np.linalg.norm(np.ptp(shape, axis=0))
            assert np.abs(found - shape).max() <= 1e-5 * diagonal, (method, frame)


def test_fewer_influences_are_the_heaviest(browser, made):
    page = made.get("human") or made["wrist"]
    browser.show(page.page)
    header, meshes = read_page.read(page.page)
    arrays, most, frame = meshes[0], 2 if "human" in made else 1, header["start"]
    spans = zip(arrays["offsets"], arrays["offsets"][1:], strict=False)
    kept = [
        first + np.sort(np.argsort(-arrays["weights"][first:end], kind="stable")[:most])
        for first, end in spans
    ]
    own = np.concatenate(kept)
    fewer = {
        **arrays,
        "offsets": np.cumsum([0, *map(len, kept)]),
        "bones": arrays["bones"][own],
        "weights": arrays["weights"][own],
    }
    for method in ("lbs", "dq", "cor"):
        expected = read_page.points(header["parts"][0], fewer, method, frame)
        found = points(browser, 0, f"'{method}'", frame, most)
        assert np.abs(found - expected).max() <= 1e-5 * np.linalg.norm(np.ptp(expected, axis=0)), method
        assert np.abs(found - points(browser, 0, f"'{method}'", frame)).max() > 1e-3


def test_heat_maps_show_the_measures(browser, made):
    page = made["wrist"]
    browser.show(page.page)
    header, (arrays,) = read_page.read(page.page)
    part, frame = header["parts"][0], header["start"]
    world = arrays["worlds"][frame, :3, :3].astype(np.float64)
    own, reference = (read_page.points(part, arrays, method, frame) for method in ("dq", "blender"))
    distances, stretches = (
        browser.floats(f"window.sinew.values(0, 'dq', {frame}, {measure})").reshape(-1, 4)[:, 3]
        for measure in (1, 2)
    )
    diagonal = np.linalg.norm(np.ptp(own, axis=0))
    expected = np.linalg.norm((own - reference) @ world.T, axis=1)
    np.testing.assert_allclose(distances, expected, atol=2e-5 * diagonal)
    assert expected.max() == pytest.approx(header["measures"][0]["high"], rel=1e-4)
    ends = arrays["edges"].astype(np.int64)
    lengths = [
        np.linalg.norm((of[ends[:, 0]] - of[ends[:, 1]]) @ world.T, axis=1) for of in (own, arrays["rest"])
    ]
    ratios, worst = np.log(lengths[0] / lengths[1]), np.zeros(len(own))
    for side in (0, 1):
        for edge in np.argsort(np.abs(ratios)):
            if abs(ratios[edge]) > abs(worst[ends[edge, side]]):
                worst[ends[edge, side]] = ratios[edge]
    # Of two edges stretched and squeezed alike, rounding decides.
    np.testing.assert_allclose(np.abs(np.log(stretches)), np.abs(worst), atol=2e-3)


def test_keys_and_controls(browser, made):
    browser.show(made["wrist"].page)
    assert browser.run("return performance.getEntriesByType('resource').length") == 0
    assert browser.run(KEYS_ARE_NAMED) == 0
    assert browser.run("return window.sinew.state.panes") == 2
    methods = list(browser.run("return window.sinew.state.methods"))
    frame = browser.run("return window.sinew.state.frame")
    browser.press("f")
    assert browser.run("return window.sinew.state.methods") == methods[::-1]
    assert "Now " in browser.run("return document.getElementById('said').textContent")
    browser.press(".")
    assert browser.run("return window.sinew.state.frame") == frame + 1
    shown = browser.run("return document.getElementById('frame-shown').textContent")
    assert shown == str(browser.run(f"return window.sinew.header.frames[{frame + 1}]"))
    browser.press(" ")
    browser.wait(f"window.sinew.state.frame !== {frame + 1}")
    browser.press(" ")
    assert browser.run("return window.sinew.state.playing") is False
    assert browser.run("return document.getElementById('legend').hidden") is True
    browser.press("h")
    assert browser.run("return window.sinew.state.measure") == 1
    assert browser.run("return document.getElementById('ticks').childElementCount") == 3
    browser.run("document.getElementById('view').focus()")
    yaw, zoom = browser.run("return [window.sinew.state.yaw, window.sinew.state.zoom]")
    browser.press("+")
    browser.press("\ue014")
    after = browser.run("return [window.sinew.state.yaw, window.sinew.state.zoom]")
    assert after[0] != yaw
    assert after[1] > zoom
    assert browser.run("return window.sinew.way.error()") == 0


def test_variants_have_stages_of_their_own(browser, varied):
    """As the page's data has them, which tests with Blender compare."""
    page, keys = varied
    browser.show(page)
    header, meshes = read_page.read(page)
    assert tuple(header["methods"]) == keys
    shapes = []
    for key in keys:
        expected = read_page.points(header["parts"][0], meshes[0], key, 2)
        found = points(browser, 0, f"'{key}'", 2)
        assert np.abs(found - expected).max() <= 1e-5 * np.linalg.norm(np.ptp(expected, axis=0)), key
        shapes.append(found)
    assert all(np.abs(a - b).max() > 1e-3 for a, b in itertools.combinations([*shapes[:3], shapes[4]], 2))
    assert browser.run("return document.getElementById('stages-set').hidden")
    labels = "return [...document.getElementById('method-0').options].map((one) => one.textContent)"
    assert browser.run(labels)[1:3] == [
        "Soft: Dual Quaternion with Twist Spread",
        "Dual Quaternion with Limit Bulge",
    ]
    # What is recorded has all bones.
    browser.run(f"window.sinew.set({{ frame: 2, panes: 2, methods: ['{keys[4]}', '{keys[3]}'], most: 1 }})")
    panes = "return ['pane-0', 'pane-1'].map((id) => document.getElementById(id).textContent)"
    assert browser.run(panes) == [
        "Dual Quaternion with Twist Spread and Delta Mush, all bones",
        "Linear Blend",
    ]
    assert np.array_equal(points(browser, 0, f"'{keys[4]}'", 2, 1), shapes[4])
    assert np.abs(points(browser, 0, f"'{keys[3]}'", 2, 1) - shapes[3]).max() > 1e-3


def test_a_wipe_shows_two_over_each_other(browser, varied):
    """What is left of its handle is the first, what is right of it the second, with one camera."""
    page, keys = varied
    browser.show(page)
    browser.run(f"window.sinew.set({{ frame: 2, panes: 1, methods: {list(keys[:2])} }})")
    assert browser.run("return document.getElementById('wipe').hidden")
    wholes = []
    for methods in (keys[:2], keys[1::-1]):
        browser.run(f"window.sinew.set({{ methods: {list(methods)} }})")
        wholes.append(pixels(browser))
    browser.run(f"window.sinew.set({{ methods: {list(keys[:2])} }})")
    browser.press("w")
    middle = wholes[0].shape[1] // 2
    assert np.abs(wholes[0] - wholes[1])[:, middle - 150 : middle].max() > 50
    for share in (0.5, 0.3, 1.0, 0.0):
        browser.run(f"window.sinew.set({{ wipe: {share} }})")
        cut, found = round(share * wholes[0].shape[1]), pixels(browser)
        np.testing.assert_array_equal(found[:, :cut], wholes[0][:, :cut])
        np.testing.assert_array_equal(found[:, cut:], wholes[1][:, cut:])
    handle = "document.getElementById('wipe')"
    browser.run(f"window.sinew.set({{ wipe: 0.5 }}); {handle}.focus()")
    browser.press("\ue014")
    assert browser.run("return window.sinew.state.wipe") == pytest.approx(0.52)
    assert browser.run(f"return {handle}.getAttribute('aria-valuenow')") == "52"
    browser.run(DRAG)
    assert browser.run("return window.sinew.state.wipe") == pytest.approx(0.25, abs=0.01)
    browser.press("w")
    assert browser.run(f"return {handle}.hidden")
    assert browser.run("return [window.sinew.state.panes, window.sinew.state.wipe]") == [2, None]


def test_a_click_on_the_sheet_goes_there(browser, sheet):
    browser.show(sheet, is_still=True)
    header, _meshes = read_page.read(sheet)
    rows, columns = header["sheet"]["rows"], header["sheet"]["columns"]
    assert browser.run("return !document.getElementById('sheet').hidden")
    picture = "document.querySelector('#cells img')"
    assert browser.wait(f"{picture}.naturalWidth") == header["sheet"]["width"]
    buttons = "[...document.querySelectorAll('#cells button')]"
    labels = browser.run(f"return {buttons}.map((one) => one.getAttribute('aria-label'))")
    assert len(labels) == len(rows) * (1 + len(columns))
    assert labels[-1] == f"{columns[-1]['title']}, Soft: Dual Quaternion with Delta Mush"
    # Where the picture of the last row and column is, as it is shown.
    left, top, width, height = rows[-1]["cells"][-1]
    size = f"[{picture}.clientWidth, {picture}.clientHeight]"
    wide, high = browser.run(f"return {size}")
    click = (
        f"const box = {picture}.getBoundingClientRect();"
        f"document.getElementById('cells').scrollIntoView(false);"
        f"const found = {buttons}.find((one) => {{"
        f"  const own = one.getBoundingClientRect(), all = {picture}.getBoundingClientRect();"
        f"  const x = all.left + {wide * (left + width / 2)}, y = all.top + {high * (top + height / 2)};"
        f"  return own.left < x && x < own.right && own.top < y && y < own.bottom;"
        f"}}); found.click(); return found.getAttribute('aria-label')"
    )
    assert browser.run(click) == labels[-1]
    assert browser.run("return document.getElementById('sheet').hidden")
    frame, methods = browser.run("return [window.sinew.state.frame, window.sinew.state.methods]")
    assert frame == columns[-1]["frame"]
    assert methods == [rows[-1]["name"], rows[0]["name"]]
    # The camera is on the sheet's side, and looks at what it shows.
    yaw, pitch = browser.run("return [window.sinew.state.yaw, window.sinew.state.pitch]")
    back = np.sin(yaw) * np.cos(pitch), -np.cos(yaw) * np.cos(pitch), np.sin(pitch)
    np.testing.assert_allclose(back, columns[-1]["direction"], atol=1e-6)
    shown = pixels(browser)
    browser.press("f")
    assert np.abs(pixels(browser) - shown).max() > 30
    browser.press("\ue00c")
    assert browser.run("return !document.getElementById('sheet').hidden")
    pressed = "return document.querySelectorAll('#cells [aria-pressed=true]').length"
    assert browser.run(pressed) == 1
    browser.press("c")
    assert browser.run("return document.getElementById('sheet').hidden")


def test_stages_are_switched(browser, made):
    browser.show(made["wrist"].page)
    assert browser.run("return document.getElementById('stages-set').hidden")
    page = made["staged"]
    browser.show(page.page)
    frame = read_page.read(page.page)[0]["frames"].index(page.frames[-1])
    assert browser.run("return document.getElementById('stages-set').textContent.trim()") == (
        "Twist Spread and Limit Bulge"
    )
    staged = points(browser, 0, "'dq'", frame)
    browser.run("window.sinew.set({ methods: ['blender', 'dq'] })")
    labels = "return ['pane-0', 'pane-1'].map((id) => document.getElementById(id).textContent)"
    plain = ["Armature modifier", "Dual Quaternion"]
    assert browser.run(labels) == [plain[0], f"{plain[1]} with Twist Spread and Limit Bulge"]
    browser.press("s")
    assert browser.run(labels) == plain
    assert browser.run("return document.getElementById('stages').checked") is False
    assert np.abs(points(browser, 0, "'dq'", frame) - staged).max() > 0.01
    browser.press("s")
    assert np.array_equal(points(browser, 0, "'dq'", frame), staged)


def test_a_fault_is_shown_at_its_place(browser, bent):
    page, report = bent
    browser.show(page, is_still=True)
    faults = [(joint["joint"], each) for joint in report["joints"] for each in joint["findings"]]
    texts = browser.run(
        "return [...document.querySelectorAll('#findings button')].map((each) => each.textContent)"
    )
    assert len(texts) == len(faults) > 1
    header, meshes = read_page.read(page)
    assert (browser.run("return window.sinew.state.frame"), header["frames"][0]) == (0, "At rest")
    places, second = set(), "lbs"
    for number, (joint, fault) in enumerate(faults):
        assert joint in texts[number]
        assert fault["label"] in texts[number]
        browser.press("n")
        assert browser.run("return window.sinew.state.finding") == number
        second = next(iter(fault["mends"]), second)
        assert browser.run("return window.sinew.state.methods") == ["blender", second]
        frame = browser.run("return window.sinew.state.frame")
        shown = browser.run("return document.getElementById('frame-shown').textContent")
        pose = f"{joint}: {fault['pose']}" if fault["pose"] else "At rest"
        assert shown == header["frames"][frame] == pose
        # The view is at the vertex at once, and nothing moves afterwards.
        browser.wait(IS_MARKED)
        view = browser.run(VIEW)
        browser.run("window.sinew.draw()")
        assert np.abs(browser.run(MARKED)).max() < 2.0
        assert browser.run(VIEW) == view
        own = read_page.points(header["parts"][0], meshes[0], header["parts"][0]["blender"], frame)
        world = meshes[0]["worlds"][frame].astype(np.float64)
        place = world[:3, :3] @ own[fault["vertex"]] + world[:3, 3]
        low, high = np.min(header["low"], axis=0), np.max(header["high"], axis=0)
        np.testing.assert_allclose(view[3:] + (low + high) / 2, place, atol=1e-4)
        places.add(tuple(np.round(place, 4)))
    assert len(places) > 1
    assert second == "dq"


def test_the_way_to_a_fault_is_flown(browser, bent):
    page, _report = bent
    browser.show(page)
    before = browser.run(VIEW)
    browser.run("document.querySelector('#findings button').focus()")
    # Enter.
    browser.press("\ue007")
    browser.wait(f"window.sinew.state.zoom !== {before[2]}")
    browser.wait(IS_MARKED)
    pressed = "document.querySelector('#findings button').getAttribute('aria-pressed')"
    assert browser.run(f"return {pressed}") == "true"
    assert "Pivot outside" in browser.run("return document.getElementById('said').textContent")
    assert browser.run(KEYS_ARE_NAMED) == 0
    browser.press("\ue011")
    assert browser.run(VIEW) == before


@pytest.mark.parametrize("way", ["webgpu"], indirect=True)
def test_both_ways_give_one_picture(browser, made, way):
    found = []
    for name in ("webgpu", "webgl"):
        browser.way = name
        browser.show(made["wrist"].page)
        browser.run("window.sinew.set({ measure: 1 })")
        found.append([pixels(browser, is_smooth) for is_smooth in ("false", "true")])
    for one, other in zip(*found, strict=True):
        opaque = [each[:, :, 3] > 250 for each in (one, other)]
        assert (opaque[0] != opaque[1]).mean() < 0.005
        both = opaque[0] & opaque[1]
        assert (np.abs(one - other).max(axis=2)[both] > 8).mean() < 0.005
        assert len(np.unique(one[both], axis=0)) > 100
        # Lines are drawn at other pixels, and about as much of them.
        lines = [each[:, :, 3][~opaque[0] & ~opaque[1]].sum() for each in (one, other)]
        assert lines[0] == pytest.approx(lines[1], rel=0.05)


@pytest.mark.parametrize("browser", [browsers.Chromium], indirect=True)
@pytest.mark.parametrize("way", [""], indirect=True)
def test_webgl_draws_where_no_card_computes(browser, made, way):
    browser.show(made["wrist"].page)
    assert browser.run(f"return {DRAWS}") == "WebGL 2 draws it."
    assert 0.01 < (pixels(browser)[:, :, 3] == 255).mean() < 0.9
    methods = browser.run("return window.sinew.state.methods")
    browser.press("f")
    assert browser.run("return window.sinew.state.methods") == methods[::-1]


@pytest.mark.parametrize("way", ["webgpu,webgl"], indirect=True)
def test_webgl_goes_on_where_webgpu_ends(browser, made, way):
    page = made["wrist"]
    browser.show(page.page)
    assert browser.run(f"return {DRAWS}") == "WebGPU draws it."
    before, found = pixels(browser), points(browser, 0, "'dq'", 1)
    browser.run("document.getElementById('view').focus(); window.sinew.way.lose()")
    browser.wait(f"{DRAWS} === 'WebGL 2 draws it.'")
    np.testing.assert_allclose(points(browser, 0, "'dq'", 1), found, atol=1e-5)
    assert (np.abs(before - pixels(browser)).max(axis=2) > 8).mean() < 0.005
    yaw = browser.run("return window.sinew.state.yaw")
    browser.press("\ue014")
    assert browser.run("return window.sinew.state.yaw") != yaw


@pytest.mark.parametrize("is_dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.parametrize("kind", ["compared", "bent"])
def test_it_fits_and_is_drawn(browser, made, bent, width, is_dark, kind):
    page = bent[0] if kind == "bent" else (made.get("human") or made["wrist"]).page
    browser.show(page, width, 800, is_dark)
    if kind == "bent":
        browser.press("n")
    panes = 2 if width > 720 and kind == "compared" else 1
    assert browser.run("return window.sinew.state.panes") == panes
    for pane in np.array_split(pixels(browser), panes, axis=1):
        assert 0.01 < (pane[:, :, 3] == 255).mean() < 0.9
    # Firefox has a least width of a window.
    inner = browser.run("return innerWidth")
    assert browser.run("return document.documentElement.scrollWidth") <= inner
    folder = os.environ.get("SINEW_PICTURES")
    if folder:
        words = type(browser).__name__.lower(), browser.way, kind, str(width), "dark" if is_dark else "light"
        Path(folder, f"{'-'.join(words)}.png").write_bytes(browser.picture())
