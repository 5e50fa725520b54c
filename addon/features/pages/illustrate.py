# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of a comparison: methods side by side, heat maps, close-ups of the worst positions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...deform import characters
from ..measure import subjects
from ..measure.comparison import Comparison, Worst
from ..measure.heat_scale import HeatScale
from ..measure.metrics import METRICS, Metric
from ..measure.subjects import Subject
from . import render
from .page import Row, Sheet
from .render import Studio
from .views import View, close_view


@dataclass
class HeatPlan:
    """A heat map to draw, at the worst frame of its metric, for each method.

    colours  by method, [vertices of all meshes, 3]
    close    a view of the worst position
    title    names the position and the frame
    """

    metric: Metric
    scale: HeatScale
    frame: float
    colours: dict[str, np.ndarray]
    close: View
    where: str


class Illustrator:
    """Draws into a folder, one picture at a time."""

    def __init__(self, subject: Subject, comparison: Comparison, studio: Studio, folder: Path) -> None:
        self._subject, self._comparison = subject, comparison
        self._studio, self._folder = studio, folder
        self._methods = list(comparison.methods)

    def plan(self, frame_count: int) -> None:
        """Chooses the frames at which a measure is worst, and each metric's worst position."""
        comparison = self._comparison
        self.frames = comparison.worst_frames(frame_count)
        self._heat = [
            self._plan_heat(metric, worst)
            for metric in METRICS.values()
            if comparison.shows(metric.worst, (worst := comparison.worst(metric.worst)).value)
        ]
        drawn = sorted({*self.frames, *(heat.frame for heat in self._heat)})
        views = render.whole_views(self._subject.meshes, self._methods, drawn)
        self._whole = dict(zip(drawn, views, strict=True))

    @property
    def picture_count(self) -> int:
        return len(self._methods) * (len(self.frames) + 3 * len(self._heat))

    def draw(self) -> Iterator[None]:
        """Draws everything that was planned; yields after each picture. Afterwards `sheets` has them."""
        rows: dict[float, list[Path]] = {frame: [] for frame in self.frames}
        heat_rows: list[list[list[Path]]] = [[[], [], []] for _ in self._heat]
        for method in self._methods:
            for frame in self.frames:
                self._pose(method, frame)
                rows[frame].append(self._picture(self._whole[frame], f"{method} {frame}"))
                yield
            for plan, (whole, close, clay) in zip(self._heat, heat_rows, strict=True):
                name = f"{method} {plan.metric.name} {plan.frame}"
                self._pose(method, plan.frame)
                clay.append(self._picture(plan.close, f"{name} close clay"))
                yield
                with subjects.skinning_alone(self._subject.meshes):
                    self._pose(method, plan.frame)
                    copies = self._studio.painted(
                        self._subject.meshes, self._subject.split(plan.colours[method])
                    )
                with copies:
                    whole.append(self._picture(self._whole[plan.frame], name))
                    yield
                    close.append(self._picture(plan.close, f"{name} close"))
                    yield
        self.sheets = [
            Sheet(
                "Methods beside each other",
                "The frames at which a measure is worst, with one camera for all methods.",
                [Row(f"Frame {frame}", pictures) for frame, pictures in rows.items()],
            ),
            *(
                self._heat_sheet(plan, *pictures)
                for plan, pictures in zip(self._heat, heat_rows, strict=True)
            ),
        ]

    def _plan_heat(self, metric: Metric, worst: Worst) -> HeatPlan:
        comparison, subject = self._comparison, self._subject
        scale = HeatScale.over(metric, [*comparison.summaries.values()], comparison.rest.diagonal)
        shapes = subjects.shapes_at(subject, [*self._methods, comparison.reference], worst.frame)
        reference = shapes[comparison.reference]
        fields = {
            method: subject.gauge.measure(shapes[method], reference).field(metric.name)
            for method in self._methods
        }
        vertex = int(np.argmax(scale.severity(fields[worst.method])))
        mesh, index = subject.owner_of(vertex)
        where = f"vertex {index} of {mesh} under {comparison.methods[worst.method]}"
        places = np.stack([shapes[method][vertex] for method in self._methods])
        close = close_view(subject.character_of(vertex, shapes[worst.method]), places)
        colours = {method: scale.colours(field) for method, field in fields.items()}
        return HeatPlan(metric, scale, worst.frame, colours, close, where)

    def _heat_sheet(
        self, plan: HeatPlan, whole: Sequence[Path], close: Sequence[Path], clay: Sequence[Path]
    ) -> Sheet:
        return Sheet(
            f"{plan.metric.label} at frame {plan.frame}",
            f"{plan.metric.text} The colours mean the same at all frames; this frame is the worst, and the "
            f"close-ups show the worst place, {plan.where}.",
            [Row("Whole", whole), Row("Worst place", close), Row("The same in clay", clay)],
            plan.scale,
        )

    def _pose(self, method: str, frame: float) -> None:
        characters.use_method_on(self._subject.meshes, method)
        characters.set_frame(self._subject.scene, frame)

    def _picture(self, view: View, name: str) -> Path:
        path = self._folder / f"{name.replace(' ', '-')}.png"
        self._studio.picture(view, path)
        return path
