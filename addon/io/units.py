# SPDX-License-Identifier: GPL-3.0-or-later
"""Formats measured values for display, in the units of the scene."""

import bpy

# Shorter lengths, as a share of a unit, are shown as 0.
LEAST_LENGTH = 1e-6


def text(scene: bpy.types.Scene, unit: str, value: float, signed: bool = False, short: bool = False) -> str:
    """Formats a value whose unit is "length", "ratio" or "share", as in Metric, or "area" or "volume"; "not
    defined" for NaN.

    signed  with a plus for positive values, as for a change
    short   for a narrow column
    """
    if value != value:
        return "not defined"
    sign = "+" if signed and value > 0.0 else ""
    if unit == "length":
        return sign + _length(scene.unit_settings, value, digits=2 if short else 3)
    if unit in _DIMENSIONS:
        return _power_of_length(scene.unit_settings, unit, value, digits=2 if short else 3)
    if unit == "ratio":
        return f"{value:.2f}\u00d7"
    return f"{sign}{100 * value:.1f} %" if short else f"{sign}{100 * value:.3g} %"


_DIMENSIONS = {"area": 2, "volume": 3}


def _power_of_length(settings: bpy.types.UnitSettings, unit: str, value: float, digits: int) -> str:
    power = _DIMENSIONS[unit]
    if settings.system == "NONE":
        return f"{value:.{digits}g}"
    value *= settings.scale_length**power
    if settings.system == "METRIC":
        # Blender would print thousands of cubic centimetres.
        return f"{value:.{digits}g} m{'²³'[power - 2]}"
    return bpy.utils.units.to_string(settings.system, unit.upper(), value, precision=digits)


def _length(settings: bpy.types.UnitSettings, value: float, digits: int) -> str:
    if settings.system == "NONE":
        return f"{value:.{digits}g} units"
    value *= settings.scale_length
    if abs(value) < LEAST_LENGTH:
        value = 0.0
    return bpy.utils.units.to_string(settings.system, "LENGTH", value, precision=digits)
