# SPDX-License-Identifier: GPL-3.0-or-later
"""The methods as items of an enum property, below the headings of the library's list."""

from __future__ import annotations

from itertools import groupby

import sinew


def method_items(first_number: int = 0) -> list[tuple[str, str, str, int]]:
    """Returns the items. Blender shows an item without identifier as a heading. A property with these items
    needs a default: otherwise it would be the first heading.

    first_number  added to the numbers of methods, which start at 1
    """
    items = []
    groups = groupby(sinew.methods(), lambda method: method.group)
    for number, (group, methods) in enumerate(groups, start=1):
        # Negative, so never the value of a property.
        items.append(("", group, "", -number))
        items += [(m.name, m.label, m.description, m.number + first_number) for m in methods]
    return items
