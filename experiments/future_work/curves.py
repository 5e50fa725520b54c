# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's cubic Hermite spline. Keys [n, 3] or [n, 8], times and `at` are as for sinew.spline."""

from future_work_native.curves import hermite

__all__ = ["hermite"]
