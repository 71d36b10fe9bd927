"""What the figures share: sizes, the output folder, renders that several need, and how a picture is drawn."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

import fluorspar
from fluorspar.staged.options import StagedOptions

POINTS = Path(__file__).parents[1] / "cornell-points.csv"
NUMBERED = {
    "direct_reflection": "1 direct reflection",
    "direct_luminescence": "2 direct luminescence",
    "indirect_reflection": "3 indirect reflection",
    "indirect_luminescence": "4 indirect luminescence",
    "luminescent_reflection": "5 luminescent reflection",
    "reexcitation": "6 re-excitation",
}


@dataclass(frozen=True)
class Sizes:
    """How large and how fine everything is."""

    pixels: int  # of a picture, each side
    samples: int
    bands: str
    staged_pixels: int
    staged_samples: int
    staged_bands: str
    patches: int  # of the object
    seeds: int  # independent renders behind each standard error
    finding_pixels: int
    finding_samples: int
    foot_emitters: tuple[int, ...] = (8,)  # along each side of the floor


TINY = Sizes(16, 4, "400:700:50", 8, 4, "400:700:50", 4, 2, 16, 4)
QUICK = Sizes(128, 64, "360:700:5", 48, 16, "400:700:50", 25, 2, 48, 16)
FULL = Sizes(512, 256, "360:700:5", 128, 64, "360:700:10", 100, 4, 128, 64, (8, 32))


@dataclass(frozen=True)
class Step:
    """A figure or a number: its function, whose docstring is the caption."""

    key: str
    title: str
    make: Callable[[Workshop], Made]

    @property
    def made_by(self) -> str:
        return f"{self.make.__module__.removeprefix('paper_figures.')}.{self.make.__name__}"

    @property
    def caption(self) -> str:
        return " ".join((self.make.__doc__ or "").split())


@dataclass(frozen=True)
class Made:
    """What a step made: pictures in the output folder, and numbers in words."""

    pictures: list[str] = field(default_factory=list)
    numbers: dict[str, str] = field(default_factory=dict)
    text: str = ""

    def save(self, path: Path, **others: Any) -> None:
        path.write_text(json.dumps(asdict(self) | others, indent=1, ensure_ascii=False), encoding="utf-8")


STEPS: dict[str, Step] = {}


def step(key: str, title: str) -> Callable[[Callable[[Workshop], Made]], Callable[[Workshop], Made]]:
    """Register a function as what makes a figure ("9") or a number ("times")."""

    def register(make: Callable[[Workshop], Made]) -> Callable[[Workshop], Made]:
        STEPS[key] = Step(key, title, make)
        return make

    return register


def in_order() -> list[Step]:
    """All steps: figures by their number, then the others."""
    return sorted(STEPS.values(), key=lambda step: int(step.key) if step.key.isdigit() else 1000)


def stated(values: Any, unit: str = "%") -> str:
    """Mean and standard error of independent values, such as "+5.81 ± 0.22 %"."""
    values = np.asarray(values, dtype=float) * (100 if unit == "%" else 1)
    error = values.std(ddof=1) / np.sqrt(len(values))
    return f"{values.mean():+.2f} ± {error:.2f} {unit}".rstrip()


class Workshop:
    """Renders that several figures need, each made once and when it is first asked for."""

    def __init__(self, sizes: Sizes, folder: Path, bunny: str | None = None) -> None:
        self.sizes, self.folder, self.bunny = sizes, folder, bunny
        folder.mkdir(parents=True, exist_ok=True)

    def finished(self, image: Any) -> Any:
        """The image; Ctrl-C leaves a part of one, of which no figure is made."""
        if image.attrs.get("partial"):
            raise KeyboardInterrupt
        return image

    def say(self, text: str) -> None:
        """A line of progress."""
        sys.stderr.write(f"    {text}\n")

    def render(self, scene: Any, what: str, **options: Any) -> fluorspar.SpectralImage:
        self.say(f"rendering {what}")
        return self.finished(fluorspar.render(scene, progress=sys.stderr.isatty(), **options))

    def square(self, pixels: int) -> tuple[int, int]:
        return pixels, pixels

    @cached_property
    def box_paths(self) -> fluorspar.LightPaths:
        self.say("tracing cornell-box")
        size = self.square(self.sizes.pixels)
        return fluorspar.trace("cornell-box", size=size, spp=self.sizes.samples, wavelengths=self.sizes.bands)

    @cached_property
    def box(self) -> fluorspar.SpectralImage:
        return self.finished(self.box_paths.image(component_errors=True))

    @cached_property
    def mesh_scene(self) -> fluorspar.Scene:
        parameters = {"mesh": self.bunny} if self.bunny else None
        return fluorspar.load_scene("cornell-mesh", parameters=parameters)

    @cached_property
    def mesh_paths(self) -> fluorspar.LightPaths:
        self.say("tracing cornell-mesh")
        size = self.square(self.sizes.pixels)
        return fluorspar.trace(
            self.mesh_scene, size=size, spp=self.sizes.samples, wavelengths=self.sizes.bands
        )

    @cached_property
    def mesh(self) -> fluorspar.SpectralImage:
        return self.finished(self.mesh_paths.image())

    def staged(
        self, scene: Any, what: str, renderer: str | None = None, **options: Any
    ) -> fluorspar.SpectralImage:
        """By the paper's procedure, at the size and on the bands of that."""
        steps = None if renderer else self.folder / f"steps-{what}"
        return self.render(
            scene,
            f"{what} by the staged method{' on Cycles' if renderer else ''}",
            method="staged",
            size=self.square(self.sizes.staged_pixels),
            spp=self.sizes.staged_samples,
            wavelengths=self.sizes.staged_bands,
            seed=1,  # not that of the one-pass image: their noise is independent
            renderer=renderer,
            staged=StagedOptions(patches=self.sizes.patches, keep_intermediate=steps, **options),
        )

    @cached_property
    def staged_box(self) -> fluorspar.SpectralImage:
        return self.staged("cornell-box", "cornell-box")

    @cached_property
    def staged_mesh(self) -> fluorspar.SpectralImage:
        return self.staged(self.mesh_scene, "cornell-mesh")

    def like_staged(self, scene: Any, what: str) -> fluorspar.SpectralImage:
        """By the one-pass method, of the size and on the bands of the staged images."""
        return self.render(
            scene,
            f"{what} by the one-pass method",
            size=self.square(self.sizes.staged_pixels),
            spp=16 * self.sizes.staged_samples,
            wavelengths=self.sizes.staged_bands,
        )

    @cached_property
    def reference_box(self) -> fluorspar.SpectralImage:
        return self.like_staged("cornell-box", "cornell-box")

    @cached_property
    def reference_mesh(self) -> fluorspar.SpectralImage:
        return self.like_staged(self.mesh_scene, "cornell-mesh")

    @cached_property
    def _cycles(self) -> dict[str, fluorspar.SpectralImage]:
        return {}

    def on_cycles(self, scene: Any, what: str) -> fluorspar.SpectralImage:
        if what not in self._cycles:
            self._cycles[what] = self.staged(scene, what, renderer="cycles")
        return self._cycles[what]

    # drawing

    def save(self, figure: Any, name: str) -> str:
        figure.savefig(self.folder / name, dpi=150)
        return name

    def panels(self, name: str, columns: int, rows: int = 1, height: float = 2.6, width: float = 7.2) -> Any:
        """A figure with panels, ndarray of shape (rows, columns)."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(width, rows * height), layout="constrained")
        return figure, figure.subplots(rows, columns, squeeze=False)

    def pictures(
        self,
        name: str,
        shown: Mapping[str, tuple[fluorspar.SpectralImage, Any]],
        exposure: float | None = None,
        overlay: Callable[[Any], None] | None = None,
    ) -> tuple[str, dict[str, str]]:
        """Images side by side at one exposure, which is stated; by default that of the first."""
        figure, axes = self.panels(name, len(shown), height=7.2 / max(len(shown), 2) + 0.25)
        for panel, (title, (image, component)) in zip(axes[0], shown.items(), strict=True):
            picture = image.srgb(component, exposure)
            exposure = picture.exposure
            panel.imshow(picture, interpolation="nearest")
            panel.set_title(title, fontsize=9)
            panel.set_axis_off()
            if overlay:
                overlay(panel)
        assert exposure is not None
        white = f"{1 / exposure:.4g} cd/m²"
        figure.supxlabel(f"sRGB, one exposure: white is {white}", fontsize=8)
        return self.save(figure, name), {"white of the picture": white}
