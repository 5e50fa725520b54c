# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects colours, plots and picture comparison."""

import json
import re
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from sinew_addon.base.errors import SinewError
from sinew_addon.commands import golden
from sinew_addon.features.measure.comparison import Comparison, RestFacts
from sinew_addon.features.measure.heat_scale import HeatScale, diverging, linear, viridis
from sinew_addon.features.measure.metrics import METRICS, Summary
from sinew_addon.features.pages import views
from sinew_addon.features.pages.page import legend_texts, page
from sinew_addon.features.pages.plots import line_plot
from sinew_addon.features.pages.views import View


def test_magnitudes_have_the_colours_of_matplotlib():
    matplotlib = pytest.importorskip("matplotlib")
    shares = np.linspace(0, 1, 101)
    np.testing.assert_allclose(viridis(shares), matplotlib.colormaps["viridis"](shares)[:, :3], atol=0.02)
    np.testing.assert_array_equal(viridis([-1.0, 2.0]), viridis([0.0, 1.0]))


# How dichromats perceive linear sRGB (G. Machado, M. Oliveira, L. Fernandes, 2009, severity 1).
SIGHT = {
    "usual": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritanopia": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}


def cielab(colours, sight):
    """sRGB colours [n, 3] under D65, as perceived with this kind of vision."""
    seen = np.clip(linear(np.asarray(colours)) @ SIGHT[sight].T, 0.0, 1.0)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    ratios = seen @ to_xyz.T / to_xyz.sum(axis=1)
    f = np.where(ratios > 216 / 24389, np.cbrt(ratios), (24389 / 27 * ratios + 16) / 116)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)


@pytest.mark.parametrize("sight", list(SIGHT))
def test_both_sides_of_neutral_look_different_to_all(sight):
    shares = np.linspace(0.0, 1.0, 101)
    lab = cielab(diverging(shares), sight)
    # Evenly darker away from the middle, so that the size of a value is visible without hue.
    steps = np.diff(lab[:, 0])
    assert (steps[:50] > 0.2).all()
    assert (steps[50:] < -0.2).all()
    assert abs(lab[0, 0] - lab[-1, 0]) < 12.0, "the ends look unequally far"
    # A difference of 2.3 is just noticeable.
    apart = np.linalg.norm(lab - lab[::-1], axis=1)
    assert apart[:40].min() > 10.0
    assert apart[:25].min() > 25.0


def summary(**values):
    return Summary(**{field: values.get(field, 0) for field in Summary.__dataclass_fields__})


def test_ranges_hold_all_frames():
    frames = [summary(bulge_min=-0.3, bulge_max=0.1), summary(bulge_max=0.2, distance_max=0.7)]
    bulge = HeatScale.over(METRICS["bulge"], [frames], 1.0)
    assert (bulge.low, bulge.high) == (-0.3, 0.3)
    distance = HeatScale.over(METRICS["distance"], [frames], 1.0)
    assert (distance.low, distance.high) == (0.0, 0.7)
    assert distance.ticks(3) == pytest.approx([0.0, 0.35, 0.7])
    np.testing.assert_allclose(bulge.colours(np.array([0.0])), diverging([0.5]))


@pytest.mark.parametrize(
    ("least", "most", "high"), [(0.8, 1.5, 1.5), (0.5, 1.2, 2.0), (0.01, 50.0, 4.0), (0.999, 1.0, 2**0.1)]
)
def test_ratios_are_shown_around_one(least, most, high):
    scale = HeatScale.over(METRICS["stretch"], [[summary(stretch_min=least, stretch_max=most)]], 1.0)
    assert (scale.low, scale.high) == pytest.approx((1 / high, high))
    np.testing.assert_allclose(scale.colours(np.array([1 / high, 1.0, high])), diverging([0.0, 0.5, 1.0]))
    np.testing.assert_array_equal(np.argsort(scale.severity(np.array([1.5, 0.25, 1.0]))), [2, 0, 1])


def test_rounding_errors_are_not_scaled_up():
    scale = HeatScale.over(METRICS["distance"], [[summary(distance_max=1e-9)]], 2.0)
    assert scale.high == pytest.approx(2e-4)


@pytest.mark.parametrize(
    ("largest", "high"), [((0.0, 0.5, 0.04), 0.08), ((0.3, 0.5), 0.5), ((0.0, 0.5), 0.5), ((0.5,), 0.5)]
)
def test_one_torn_mesh_does_not_stretch_the_scale(largest, high):
    scale = HeatScale.over(METRICS["distance"], [[summary(distance_max=most)] for most in largest], 1.0)
    assert scale.high == pytest.approx(high)
    assert scale.clipped == (high < max(largest))
    assert legend_texts(scale, "m")[-1] == (f"{high:g} m and more" if scale.clipped else f"{high:g} m")


SVG = "{http://www.w3.org/2000/svg}"


def paths_of(svg, start):
    """[[(x, y), ...], ...]: the paths of lines whose id starts with this, one for each piece without
    gaps."""
    found = []
    for group in ElementTree.fromstring(svg).iter(f"{SVG}g"):
        if group.get("id", "").startswith(start):
            for path in group.iter(f"{SVG}path"):
                if not path.get("id"):
                    found += [
                        re.findall(r"(-?[\d.]+) (-?[\d.]+)", run) for run in path.get("d").split("M")[1:]
                    ]
    return [[(float(x), float(y)) for x, y in run] for run in found]


def marks_of(svg):
    """The positions of points that are drawn separately."""
    groups = [
        g
        for g in ElementTree.fromstring(svg).iter(f"{SVG}g")
        if g.get("id", "").startswith(("Gaps-points", "One-points", "None-points"))
    ]
    return [(float(u.get("x")), float(u.get("y"))) for group in groups for u in group.iter(f"{SVG}use")]


def test_gaps_and_single_values_are_drawn():
    svg = line_plot("Gaps", "", [1, 2, 3, 4, 5], {"a": [[1.0, 2.0, float("nan"), 3.0, float("inf")]]})
    assert [len(run) for run in paths_of(svg, "Gaps-line") if len(run) > 1] == [2]
    assert len(marks_of(svg)) == 1
    assert len(marks_of(line_plot("One", "%", [7], {"a": [[0.0]], "b": [[5.0]]}))) == 2
    assert marks_of(line_plot("None", "", [1, 2], {"a": [[float("nan")] * 2]})) == []


def test_plots_of_one_page_share_no_ids_and_are_the_same_each_time():
    lines = {"a": [[0.0, 1.0]]}
    first, second = (line_plot(title, "", [1, 2], lines) for title in ("One", "Two"))
    assert first == line_plot("One", "", [1, 2], lines)
    references = [set(re.findall(r"url\(#([^)]*)\)", svg)) for svg in (first, second)]
    assert references[0]
    assert references[0].isdisjoint(references[1])


def test_without_matplotlib_the_page_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    rest = RestFacts(8, 12, 1.0, 1.0, 6.0, 0, 0)
    summaries = {"lbs": [summary(), summary()]}
    times = {"lbs": [1.0, 1.0]}
    comparison = Comparison(
        "a.blend", ["A"], {"lbs": "Linear"}, "lbs", "m", rest, [1.0, 2.0], summaries, times, times, {"A": []}
    )
    text = page(comparison, [])
    assert "Not drawn: plots need matplotlib" in text
    assert "All frames" in text


def test_only_what_differs_visibly_counts():
    picture = np.zeros((10, 20, 4))
    picture[2:8, 5:15] = [0.5, 0.5, 0.5, 1.0]
    other = picture.copy()
    # The colour behind alpha 0 is invisible; a little alpha is along every edge.
    other[0, 0] = [1.0, 1.0, 1.0, 0.0]
    other[2, 5] = [0.6, 0.6, 0.6, 1.0]
    assert golden.differing_share(golden.difference(picture, other)) == 0.0
    other[7, 5:9] = 0.0
    differences = golden.difference(picture, other)
    assert golden.differing_share(differences) == pytest.approx(4 / 200)
    shown = golden.difference_picture(differences, picture)
    coloured = np.ptp(shown[:, :, :3], axis=2) > 0.1
    assert coloured.sum() == 4
    assert coloured[7, 5:9].all()


def test_names_of_pictures_sort_by_frame():
    frames = [-3, 1, 6.5, 6.25, 12, 1234]
    assert [golden.picture_name(f) for f in frames[1:]] == [
        "0001.png",
        "0006.50.png",
        "0006.25.png",
        "0012.png",
        "1234.png",
    ]
    assert len({golden.picture_name(f) for f in [*frames, -2.5, 6.75]}) == 8


def test_a_folder_that_holds_no_golden_pictures_is_named(tmp_path):
    with pytest.raises(SinewError, match="sinew render"):
        golden.RenderSettings.read(tmp_path)
    (tmp_path / golden.SETTINGS).write_text('{"frames": 3}')
    with pytest.raises(SinewError, match="make the pictures again"):
        golden.RenderSettings.read(tmp_path)


def test_settings_of_golden_pictures_are_read_as_written(tmp_path):
    view = View(np.array([0.0, -1.0, 0.0]), np.zeros(3), 1.0, 2.0, 3.0)
    names = ("a.blend", "lbs", [1, 2.5], "cycles", 64, False, ["Body"], [view, view])
    settings = golden.RenderSettings(*names, set=["mix.method=dq", "mix.group=Arms"])
    path = tmp_path / golden.SETTINGS
    path.write_text(settings.to_json())
    assert golden.RenderSettings.read(tmp_path).to_json() == settings.to_json()
    # Written by a version without parameters.
    older = json.loads(settings.to_json())
    del older["set"]
    path.write_text(json.dumps(older))
    assert golden.RenderSettings.read(tmp_path).set == []
    path.write_text(json.dumps(older | {"set": [1]}))
    with pytest.raises(SinewError, match="make the pictures again"):
        golden.RenderSettings.read(tmp_path)


def test_a_joint_is_seen_from_the_side_where_its_bend_shows():
    """Along the axis of a bend, from the side that nothing hides; across the limb where it is twisted."""
    arm = np.stack([np.linspace(-1.0, 1.0, 21), np.zeros(21), np.zeros(21)], axis=1)
    wall = np.random.default_rng(1).uniform(-0.5, 0.5, (200, 3)) * (1.0, 0.0, 1.0)
    x, y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    for place in (-3.0, 3.0):
        view = views.joint_view(np.concatenate([arm, wall + place * y]), arm, y, x)
        assert view.direction[1] * place < -0.8 * abs(place)
        assert view.width == view.height > 1.9
        np.testing.assert_allclose(view.target, 0.0, atol=1e-9)
    twisted = views.joint_view(arm, arm, x, x)
    assert abs(twisted.direction @ x) < 1e-6
