# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences with values, which the panel can translate."""


class Phrase(str):
    """A sentence in English that keeps its template and values; used as plain text outside the panel.

    template  the sentence with names in braces
    values    for those names; phrases among them are translated, too
    """

    __slots__ = ("template", "values")

    template: str
    values: dict[str, object]


def phrase(template: str, /, **values: object) -> Phrase:
    made = Phrase(template.format(**values))
    made.template, made.values = template, values
    return made
