# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 3.6 to 3.11 of `./dev report`: pictures of deformed meshes, and measurements of them."""

from __future__ import annotations

import io

import numpy as np
import pytest
from conftest import REPOSITORY
from PIL import Image
from sinew_addon.features.pages import render
from smith_2013 import figures as report_figures
from smith_2013 import meshes

pytestmark = pytest.mark.once
SIZE = 96


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    engine = render.chosen_engine("auto")
    scratch = tmp_path_factory.mktemp("pictures")
    made = report_figures.figures(REPOSITORY / "blend_files", engine, SIZE, scratch, lambda what: None)
    return {figure.number: figure for figure in made}


def test_all_are_drawn(figures):
    assert [len(figure.pictures) for figure in figures.values()] == [5, 5, 5, 1, 5, 5]
    for figure in figures.values():
        for picture in figure.pictures:
            covered = np.array(Image.open(io.BytesIO(picture.content)).getchannel("A")) > 0
            assert 0.02 < covered.mean() < 0.9, (figure.number, picture.caption)


def test_they_show_what_the_report_says(figures):
    for figure in figures.values():
        assert figure.missing is None
        for fact in figure.facts:
            assert fact.agrees, (figure.number, fact.ours)


def coverage(picture):
    return int((np.array(Image.open(io.BytesIO(picture.content)).getchannel("A")) > 0).sum())


def test_pictures_show_it_too(figures):
    matrices, pairs, duals = ([coverage(p) for p in figures[n].pictures] for n in ("3.6", "3.7", "3.8"))
    # At the keyframes all are 1; in between matrices shrink, and the other two are equal.
    assert matrices[0] == pairs[0] == duals[0]
    assert matrices[4] == pairs[4] == duals[4]
    assert matrices[2] < 0.6 * pairs[2]
    assert pairs == duals


def test_link_volumes_of_linear_matrices_by_hand(figures):
    # Halfway between -45 and 45 degrees, matrices are cos 45 thick in two directions: half the volume, and
    # the next joint half of that.
    values = figures["3.6"].facts[0].values
    for link in range(1, 7):
        assert values[f"link {link} at t = 0.5"] == pytest.approx(0.5 ** (link - 1), rel=1e-5)


def test_twist_of_linear_matrices_by_hand(figures):
    # Half of a rotation by 170 degrees and half of none: cos 85 degrees.
    values = figures["3.11"].facts[0].values
    assert values["radius, lbs"] == pytest.approx(np.cos(np.radians(85)), abs=2e-3)


def test_the_first_picture_of_a_chain_is_the_pose_in_the_file():
    import bpy
    from sinew_addon.deform import characters
    from sinew_addon.io import files

    files.open_file(REPOSITORY / "blend_files" / report_figures.LINKS)
    scene = bpy.context.scene
    (obj,) = characters.deformed_meshes(scene)
    poses = {}
    for frame in (report_figures.FIRST_KEY, report_figures.SECOND_KEY):
        characters.set_frame(scene, frame)
        # The Armature modifier's own shape.
        poses[frame] = characters.world_points([obj])
    chain = report_figures.read_chain(obj)
    for method in meshes.HIERARCHIES:
        for t, frame in ((0.0, report_figures.FIRST_KEY), (1.0, report_figures.SECOND_KEY)):
            assert np.abs(chain.between(t, method) - poses[frame]).max() < 2e-6
