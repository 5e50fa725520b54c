# SPDX-License-Identifier: GPL-3.0-or-later
"""The one exception that carries a sentence for the user."""


class SinewError(Exception):
    """What is wrong and what to do, in one sentence."""
