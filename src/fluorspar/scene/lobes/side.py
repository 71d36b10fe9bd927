"""One side of a BSDF while it is read: its spectra, and which channel of the probe each has."""

from __future__ import annotations

from dataclasses import dataclass, field

from fluorspar.errors import SceneError, message
from fluorspar.scene.lobes.lobe import CHANNELS, Lobe

__all__ = ["Side", "Spectral"]


@dataclass(frozen=True)
class Spectral:
    """A spectrum-valued property: its lobe but for channel and ids, and the value of its probe."""

    row: int
    in_colours: bool
    mean: float
    unit: float
    texture: int = -1
    angles: int = 0
    gloss: bool = False

    def lobe(self, channel: int, ids: tuple[str, ...] = ()) -> Lobe:
        return Lobe(channel, self.row, self.unit, self.texture, self.angles, self.gloss, ids)


@dataclass
class Side:
    """One side of a BSDF while it is read; `within` are the ids of the BSDFs that are being read, from outside in."""

    where: str
    shape: int
    within: tuple[str, ...] = ()
    taken: dict[int, Spectral] = field(default_factory=dict)
    ids: dict[int, tuple[str, ...]] = field(default_factory=dict)  # of the BSDFs around each
    straight: bool = False

    def channel(self, spectral: Spectral, wanted: int | None) -> int:
        """Give a spectrum a channel; equal ones share it."""
        for channel, other in self.taken.items():
            if other == spectral and wanted in (None, channel):
                self.ids[channel] = tuple(name for name in self.ids[channel] if name in self.within)
                return channel
        free = [c for c in range(CHANNELS) if c not in self.taken]
        if wanted is not None:
            free = [c for c in free if c == wanted]
        if not free:
            raise SceneError(
                message(
                    "a BSDF has too many different spectra",
                    where=self.where,
                    expected=f"at most {CHANNELS} in one surface, blends included",
                    fix="give some of its parts one spectrum, or render it diffuse with --matte (matte=True)",
                )
            )
        self.taken[free[0]], self.ids[free[0]] = spectral, self.within
        return free[0]
