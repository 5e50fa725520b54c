# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects Flex without Blender: measures of a tube in closed form, the surface's graph against scipy, tables
and reports."""

import math
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from closed_tube import LENGTH, RADIUS, Tube, influences_of
from figures import figure
from rigs import about
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree
from sinew_addon.base.errors import WrongUse
from sinew_addon.base.steps import result_of
from sinew_addon.features.flex.measures import BENT, RINGS, SHORT, Region
from sinew_addon.features.flex.report import junit, lines, markdown, of_file
from sinew_addon.features.flex.verdict import OWN, Pose, judge
from sinew_addon.features.measure import battery
from sinew_addon.features.measure import weight_check as flex_weights
from sinew_addon.features.measure.character import Character, Skeleton
from sinew_addon.features.measure.limits import LIMITS, Table, read_table
from sinew_addon.features.measure.weight_check import WeightCheck
from sinew_addon.skinning.surface import Surface, coincident_vertices, components


class Bent(Tube):
    """A tube whose second bone is rotated about one of the axes."""

    def __init__(self, axis, degrees, shares=None):
        super().__init__()
        self.shares = self.second if shares is None else shares
        self.influences = influences_of(np.stack([1.0 - self.shares, self.shares], axis=1))
        self.motion = about(np.eye(3)[axis], degrees)

    @property
    def character(self):
        rest = np.tile(np.eye(4), (2, 1, 1))
        # Y of a bone goes along it.
        rest[:, :3, :3] = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        rest[0, 0, 3] = -LENGTH / 2
        skeleton = Skeleton.of(rest, np.full(2, LENGTH / 2), np.array([-1, 0]))
        skeleton = replace(skeleton, names=("first", "second"))
        meshes = [("Tube", len(self.rest))]
        return Character(self.surface, self.rest, self.influences, np.arange(2), skeleton, meshes)

    @property
    def frame(self):
        return self.frame_of(self.motion)

    def points(self, method):
        return self.deform("lbs" if method == OWN else method, self.motion).astype(np.float64)

    def measured(self):
        region = Region(self.character, 1)
        return region, region.measure(self.frame, self.points("lbs"), no_crossings, set())

    def verdict(self, *methods):
        poses = [Pose("bent", (1,), lambda: self)]
        steps = judge(self.character, poses, [OWN, *methods], LIMITS, no_crossings)
        shares = []
        verdict = result_of(steps, shares.append)
        assert shares == [1.0]
        return verdict


def no_crossings(_points, _triangles):
    return set()


@pytest.mark.parametrize("degrees", [60.0, 120.0, 180.0])
def test_a_twist_loses_the_radius_and_the_volume_of_the_formula(degrees):
    bent = Bent(0, degrees)
    region, found = bent.measured()

    def factor(shares):
        """Of the radius under linear blending."""
        return np.sqrt(1.0 - 4.0 * shares * (1.0 - shares) * math.sin(math.radians(degrees) / 2) ** 2)

    own, ratios = region.shares.astype(float), []
    for least, most in pairwise(RINGS):
        ring = own[(own > least) & (own <= most)]
        along = np.var(ring * LENGTH)
        squares = RADIUS**2 * factor(ring) ** 2
        ratios.append(math.sqrt((squares.mean() + along) / (RADIUS**2 + along)))
    assert found["radius"][0] == pytest.approx(min(ratios), rel=1e-5)
    shares = np.linspace(BENT, 1.0 - BENT, 1000)
    lost = 1.0 - np.mean(factor(shares) ** 2)
    assert found["volume_loss"][0] == pytest.approx(lost, abs=0.04)
    assert found["volume_gain"][0] == 0.0
    assert region.pivot() == pytest.approx(0.0, abs=1e-6)


def test_hard_weights_stretch_the_edges_between_the_bones():
    hard = Bent(2, 100.0, (Tube().rest[:, 0] > 0.0).astype(float))
    region, found = hard.measured()
    rest, points, edges = hard.rest, hard.points("lbs"), hard.surface.edges
    over = edges[hard.shares[edges].min(axis=1) != hard.shares[edges].max(axis=1)]
    before, after = (np.linalg.norm(p[over[:, 0]] - p[over[:, 1]], axis=1) for p in (rest, points))
    grown = (after - before) / np.maximum(before, SHORT * region.girth)
    assert region.girth == pytest.approx(RADIUS, rel=0.05)
    assert found["stretch"][0] == pytest.approx(1.0 + grown.max(), rel=1e-6)
    assert found["stretch"][1].vertex in over[grown.argmax()]
    verdict = hard.verdict()
    assert {each.limit.name for each in verdict.findings} >= {"stretch"}
    assert [joint.name for joint in verdict.joints if not joint.is_good] == ["second"]


def test_a_good_joint_passes_and_what_mends_a_bad_one_is_named():
    assert Bent(2, 60.0).verdict("dq").is_good
    findings = Bent(0, 170.0).verdict("dq").findings
    names = {each.limit.name: each for each in findings}
    assert "radius" in names
    assert "dq" in names["radius"].mends
    assert names["radius"].pose == "bent"
    assert names["radius"].mesh == "Tube"
    assert "dq" in names["radius"].advice


def test_what_is_not_finite_is_torn():
    bent = Bent(2, 60.0)
    points = bent.points("lbs")
    points[len(points) // 2] = np.nan
    found = Region(bent.character, 1).measure(bent.frame, points, no_crossings, set())
    assert LIMITS["stretch"].is_beyond(found["stretch"][0])
    bent.points = lambda _method: points
    (finding,) = [
        each for each in bent.verdict().to_dict()["joints"][1]["findings"] if each["name"] == "stretch"
    ]
    assert finding["value"] is None


def test_vertices_without_weights_are_counted_at_the_nearest_bone():
    bent = Bent(2, 60.0)
    weights = np.stack([1.0 - bent.shares, bent.shares], axis=1)
    bare = np.flatnonzero(bent.rest[:, 0] > 0.9)
    weights[bare] = 0.0
    bent.influences = influences_of(weights)
    values = [each for each in WeightCheck(bent.character).values() if each.name == "unweighted"]
    assert [(each.bone, each.value) for each in values] == [(1, len(bare))]
    assert values[0].place.vertex in bare


def test_a_vertex_far_over_the_surface_bleeds_as_far_as_it_is():
    bent = Bent(2, 60.0)
    x = bent.rest[:, 0]
    shares = np.clip((x + 0.1) / 0.2, 0.0, 1.0)
    far = int(np.flatnonzero(x < -0.9)[0])
    shares[far] = 0.4
    bent.influences = influences_of(np.stack([1.0 - shares, shares], axis=1))
    (found,) = [each for each in WeightCheck(bent.character).values() if each.name == "bleed"]
    assert found.bone == 1
    assert found.place.vertex == far
    # Along the tube, to the first ring that follows the second bone most.
    core = x[(shares > 0.5)].min()
    assert found.value == pytest.approx((core - x[far]) / (LENGTH / 2), rel=1e-6)


def test_a_bone_that_nothing_follows_alone_has_no_pivot():
    """As a breast's, whose head is in the chest."""
    tube = Tube()
    assert Region(Bent(0, 0.0, 0.6 * (tube.rest[:, 0] > 0.25 * LENGTH)).character, 1).pivot() == 0.0
    assert Region(Bent(0, 0.0, 1.0 * (tube.rest[:, 0] > 0.0)).character, 1).pivot() == 0.0
    assert Region(Bent(0, 0.0, np.clip(4.0 * tube.second - 3.0, 0.0, 1.0)).character, 1).pivot() > 1.0


@pytest.mark.parametrize(("share", "factor"), [(0.0, 1.0), (0.3, 0.4), (0.5, 0.0)])
def test_what_follows_the_nearest_bone_alike_is_not_astray(share, factor):
    """share: that of the nearest bone"""

    def value(share):
        shares = Tube().second.copy()
        shares[-1] = share
        found = WeightCheck(Bent(0, 0.0, shares).character).values()
        return max(each.value for each in found if each.name == "astray")

    assert value(share) == pytest.approx(factor * value(0.0), rel=1e-3, abs=1e-6)


def boxes_with_legs(moved=0.0):
    """Two legs that touch in the middle, each of its own bone, on either side of X = 0; the first vertex of
    the left one follows the other by `moved`."""
    corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 3.0)])
    points = np.concatenate([corners, corners * [-1.0, 1.0, 1.0]])
    weights = np.repeat(np.eye(2), 8, axis=0)
    weights[7] = 1.0 - moved, moved
    rest = np.tile(np.eye(4), (2, 1, 1))
    rest[:, :3, 3] = [[0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]]
    rest[:, :3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    skeleton = Skeleton.of(rest, np.full(2, 3.0), np.full(2, -1))
    skeleton = replace(skeleton, side=np.array([1, -1]), mirror=np.array([1, 0]))
    triangles = np.array([[0, 1, 2], [1, 3, 2], [8, 10, 9], [9, 10, 11]], np.int32)
    surface = Surface(16, triangles, np.empty((0, 2), np.int32), coincident_vertices(points))
    return Character(surface, points, influences_of(weights), np.arange(2), skeleton, [("Legs", 16)])


@pytest.mark.parametrize("moved", [0.0, 0.5])
def test_legs_that_touch_are_each_other_s_image(moved):
    values = [each for each in WeightCheck(boxes_with_legs(moved)).values() if each.name == "asymmetry"]
    # Of the vertex and of its image; vertices in the middle follow both by half.
    assert [each.value for each in values] == pytest.approx([2.0 * moved / (8.0 + moved)])


def test_graphs_are_those_of_scipy():
    rng = np.random.default_rng(3)
    points, pairs = rng.random((300, 3)), rng.integers(0, 300, (260, 2))
    lengths = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    graph = coo_matrix((np.maximum(lengths, 1e-12), pairs.T), (300, 300))
    count, labels = connected_components(graph, directed=False)
    found = components(300, pairs)
    assert len(np.unique(found)) == count
    assert all(len(np.unique(found[labels == label])) == 1 for label in range(count))
    core = np.zeros(300, bool)
    core[[3, 50]] = True
    # Of a pair that occurs twice, scipy would add the lengths.
    _unique, first = np.unique(np.sort(pairs, axis=1), axis=0, return_index=True)
    pairs = pairs[first]
    graph = coo_matrix((np.maximum(lengths[first], 1e-12), pairs.T), (300, 300))
    wanted = dijkstra(graph, directed=False, indices=[3, 50]).min(axis=0)
    for some in (np.arange(300), np.array([7]), np.flatnonzero(core)):
        found = flex_weights._over_surface(points, pairs, core, some)
        np.testing.assert_allclose(found, wanted[some], atol=1e-9)
    others = rng.random((40, 3))
    np.testing.assert_allclose(
        flex_weights._nearest(points, others), cKDTree(others).query(points)[0], atol=1e-9
    )
    moved = points + rng.normal(size=points.shape) * 1e-4
    order = rng.permutation(300)
    np.testing.assert_array_equal(flex_weights._matches(points, moved[order], 1.0), order)
    assert (flex_weights._matches(points, points + 5.0, 1.0) == -1).all()


@pytest.mark.parametrize("naming", ["rigify", "unreal", "mixamo", "makehuman"])
def test_each_joint_of_a_figure_is_bent_by_itself(naming):
    bones, number = figure(naming)
    found = list(battery.Battery(bones, {}, np.ones(len(bones.names), bool)).of_joints())
    for bone, pose in found:
        assert set(pose.rotations) == {bone}
        angle = math.degrees(math.acos(min(1.0, (np.trace(pose.rotations[bone]) - 1.0) / 2.0)))
        own = battery.bend_angles(bones, battery.posed(bones, pose))
        assert math.degrees(own[bone]) == pytest.approx(angle, abs=0.1)
        assert np.delete(own, bone) == pytest.approx(0.0, abs=2e-3)
    bent = {bone for bone, _pose in found}
    assert {
        number[name, side]
        for name in ("upper_arm", "forearm", "hand", "thigh", "shin", "foot")
        for side in "LR"
    } <= bent
    names = {pose.name for bone, pose in found if bone == number["forearm", "L"]}
    assert any(name.startswith("bend 100") for name in names)
    side, mirror = battery.sides(bones.names)
    for name in ("upper_arm", "shin"):
        left, right = number[name, "L"], number[name, "R"]
        assert (side[left], side[right]) == (1, -1)
        assert (mirror[left], mirror[right]) == (right, left)
    assert mirror[number["chest", ""]] == -1


def test_numbers_of_exporters_do_not_part_the_sides():
    side, mirror = battery.sides(["b_LeftHand_03", "b_RightHand_08", "b_Hip_01", "index_01_l", "index_01_r"])
    assert side.tolist() == [1, -1, 0, 1, -1]
    assert mirror.tolist() == [1, 0, -1, 4, 3]


def test_limits_of_a_joint_are_its_poses():
    bones, number = figure()
    shin = number["shin", "L"]
    limits = {bones.names[shin]: np.array([[0.0, math.radians(80.0)], [0.0, 0.0], [0.0, 0.0]])}
    poses = [
        pose
        for bone, pose in battery.Battery(bones, limits, np.ones(len(bones.names), bool)).of_joints()
        if bone == shin
    ]
    (only,) = poses
    assert math.degrees(math.acos((np.trace(only.rotations[shin]) - 1) / 2)) == pytest.approx(80.0)


def test_a_file_overrides_limits_and_poses(tmp_path):
    path = tmp_path / "table.toml"
    path.write_text(
        '[limits]\nstretch = 9\n[joints]\nforearm = ["bend 140"]\n"tail.1" = ["swing 20", "twist 10"]\n'
    )
    table = read_table(path, Table())
    assert table.limits["stretch"].value == 9.0
    assert table.limits["bulge"] == LIMITS["bulge"]
    assert LIMITS["stretch"].value != 9.0
    bones, number = figure()
    found = list(battery.Battery(bones, {}, np.ones(len(bones.names), bool)).of_joints(table.joints))
    assert [pose.name for bone, pose in found if bone == number["forearm", "L"]] == ["bend 140 front"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[limits]\nlength = 3", "expected one of unweighted"),
        ("[limits]\nstretch = true", "expected a number"),
        ('[joints]\nhand = ["wave 30"]', "expected one of bend"),
        ('[joints]\nhand = ["bend much"]', "expected one of bend"),
        ('[joints]\nhand = ["bend 30 sideways"]', "got 'bend 30 sideways'"),
        ('[joints]\nhand = "bend 30"', "expected a list"),
        ("[poses]\nhand = 3", "expected the tables"),
        ("limits = 3", "expected the tables"),
        ("[limits", "table.toml"),
    ],
)
def test_errors_of_a_table_name_the_file_and_the_key(tmp_path, text, said):
    path = tmp_path / "table.toml"
    path.write_text(text)
    with pytest.raises(WrongUse, match=r"table\.toml") as caught:
        read_table(path, Table())
    assert said in str(caught.value)


def test_no_such_table(tmp_path):
    with pytest.raises(WrongUse, match="can not be read"):
        read_table(tmp_path / "none.toml", Table())


def test_reports_say_the_same():
    bad_verdict, good_verdict = Bent(0, 170.0).verdict("dq"), Bent(2, 30.0).verdict()
    bad = of_file("a|b.blend", {**bad_verdict.to_dict(), "left_out": []})
    good = of_file("good.blend", {**good_verdict.to_dict(), "left_out": []})
    broken = of_file("broken.blend", {"error": "no mesh is deformed by an armature\x1b"})
    partly = of_file("part.blend", {**good_verdict.to_dict(), "left_out": ["Hat: shared"]})
    reports = [bad, good, broken, partly]
    assert [report["passed"] for report in reports] == [False, True, False, False]
    suites = ElementTree.fromstring(junit(reports))
    counts = [(int(s.get("tests")), int(s.get("failures")), int(s.get("errors"))) for s in suites]
    assert counts == [(2, 1, 0), (2, 0, 0), (1, 0, 1), (3, 0, 1)]
    assert [len(list(suite)) for suite in suites] == [2, 2, 1, 3]
    (failure,) = suites.iter("failure")
    assert "Radius" in failure.text
    text = markdown(reports)
    rows = [line for line in text.splitlines() if line.startswith("| second")]
    assert len(rows) == len(bad_verdict.findings)
    assert all(row.count("|") - row.count("\\|") == 5 for row in rows)
    assert "a\\|b.blend" in text
    said = "\n".join(lines(bad))
    assert "FAILED: 1 of 2 joints pass" in said
    assert "second: Radius" in said
    joint = bad["joints"][1]
    assert {each["name"] for each in joint["findings"]} == {each.limit.name for each in bad_verdict.findings}
    values = joint["values"]
    assert values["dq"]["radius"]["value"] > values["own"]["radius"]["value"]


def test_the_document_has_every_limit():
    text = (Path(__file__).resolve().parents[4] / "docs" / "flex.md").read_text(encoding="utf-8")
    rows = {row[0]: row[1] for row in re.findall(r"^\| `(\w+)` \| ([^|]+?) \|", text, re.MULTILINE)}
    for limit in LIMITS.values():
        stated = rows[limit.name].split()[0].rstrip("°")
        if limit.name != "inert":
            assert float(stated) == limit.value * (100.0 if limit.unit == "%" else 1.0), limit.name
    roles = re.findall(
        r"`(\w+)`", text[text.index("what a bone is | its poses") : text.index("## What counts")]
    )
    assert set(roles) >= set(battery.JOINTS)
