# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the figures of a joint: which of several shapes are marked as best at each."""

from sinew_addon.features.measure.joint_figures import Figures, best


def test_the_smallest_magnitude_is_best_and_equals_share_it():
    found = best(
        [Figures(0.3, -0.2, 0.1, 0.0), Figures(0.2, 0.1, 0.102, 0.0), Figures(0.205, -0.4, 0.3, 0.0)]
    )
    assert found == [{"bulge"}, {"stretch", "volume", "bulge"}, {"stretch"}]


def test_nothing_is_best_where_all_are_alike_or_torn():
    assert best([Figures(0.2, 0.1, 0.1, 0.0), Figures(0.2, -0.1, 0.1, 0.001)]) == [set(), set()]
    torn = Figures(*(float("inf"),) * 4)
    assert best([torn, Figures(9.0, 9.0, 9.0, 9.0)]) == [set(), set(Figures._fields)]
