# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks whose operations and choices are written down, one line each: test_scripted_walks.py has them.

    add Arm dq; frame 11; ~weights Arm lower; +duplicate Arm 0.9

A step is an operation (operations/) and what it chooses: names and whole numbers where it chooses among
these, and numbers with a point for its random numbers from 0 to 1. What is not written is the first choice,
and 0.3. The sides are not compared after a step with ~; one with + pushes an undo step.
"""

from __future__ import annotations

import random
import shlex
from collections.abc import Sequence

import walk

Word = str | int | float


class Chosen:
    """Stands for random.Random where an operation chooses."""

    def __init__(self, seed: int, words: Sequence[Word]) -> None:
        self.words, self.used = list(words), []
        self.others = random.Random(seed)

    def _use(self, word: Word) -> Word:
        self.words.remove(word)
        self.used.append(word)
        return word

    def _next(self, kind: type) -> Word | None:
        word = next((word for word in self.words if type(word) is kind), None)
        return None if word is None else self._use(word)

    def choice(self, choices: Sequence):
        names = [(type(name), name) for name in (getattr(each, "name", each) for each in choices)]
        for word in (*self.words, *self.used):
            if (type(word), word) in names:
                if word in self.words:
                    self._use(word)
                return list(choices)[names.index((type(word), word))]
        number = None if isinstance(names[0][1], str) or choices[0] is None else self._next(int)
        return list(choices)[number or 0]

    def random(self) -> float:
        given = self._next(float)
        return 0.3 if given is None else given

    def randrange(self, *bounds: int) -> int:
        given = self._next(int)
        return self.others.randrange(*bounds) if given is None else given

    def randint(self, first: int, last: int) -> int:
        return self.randrange(first, last + 1)

    def uniform(self, low: float, high: float) -> float:
        return self.others.uniform(low, high)

    def sample(self, choices: Sequence, count: int) -> list:
        by_name = {getattr(each, "name", each): each for each in choices}
        found = [self._use(word) for word in list(self.words) if word in by_name][:count]
        rest = [name for name in by_name if name not in found]
        return [by_name[name] for name in (*found, *self.others.sample(rest, count - len(found)))]


def number_or_name(word: str) -> Word:
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            continue
    return word


def steps_of(text: str, is_left: bool = False) -> list[walk.Step]:
    """is_left  whether Sinew leaves small meshes to their Armature modifiers, as by default. Where one of
    them loses its modifier, Sinew goes and says nothing."""
    steps: list[walk.Step] = []
    for number, part in enumerate(text.split(";")):
        name, *words = (number_or_name(word) for word in shlex.split(part))
        operation = name.lstrip("~+")
        if is_left and operation == "says":
            continue
        steps.append(walk.Step(operation, number, "~" not in name, "+" in name, tuple(words)))
        if is_left and operation == "add":
            steps.append(walk.Step("leave_small", number, "~" not in name, "+" in name, (words[0],)))
    return steps
