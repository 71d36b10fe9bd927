"""`LightPaths`: the traced light paths of a scene, kept, to be asked for images."""

from __future__ import annotations

import os
from contextlib import closing
from dataclasses import dataclass, replace

from numpy.typing import ArrayLike

from fluorspar.bispectral.donaldson import Stokes
from fluorspar.errors import OptionError, message
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob, read_grid
from fluorspar.paths.chunks import trace_chunks
from fluorspar.paths.log import Chunk
from fluorspar.paths.render import render_chunks
from fluorspar.progress import Progress, shown
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["LightPaths", "trace_job"]


@dataclass(frozen=True, repr=False)
class LightPaths:
    """Light paths of a scene, made by `fluorspar.trace`. They hold no spectrum: images of any wavelengths follow.

    Attributes
    ----------
    job : RenderJob
        What was traced. Its grid is that of the images that ask for no other.
    chunks : tuple of Chunk
        The paths, run after run of pixels.
    """

    job: RenderJob
    chunks: tuple[Chunk, ...]

    @property
    def nbytes(self) -> int:
        """Size in memory."""
        return sum(chunk.log.nbytes for chunk in self.chunks)

    def __repr__(self) -> str:
        settings = self.job.scene.settings
        samples = settings.width * settings.height * settings.spp
        return (
            f"<LightPaths of '{self.job.scene.name}': {settings.width} x {settings.height} pixels, "
            f"{settings.spp} samples, seed {self.job.seed}; {self.nbytes / 2**20:.0f} MiB, "
            f"{self.nbytes / samples:.0f} B a sample>"
        )

    def image(
        self,
        *,
        wavelengths: Wavelengths | str | ArrayLike | None = None,
        stokes: Stokes | None = None,
        excitation: str | None = None,
        component_errors: bool | None = None,
        threads: int | None = None,
        output: str | os.PathLike[str] | None = None,
        progress: Progress | bool | None = None,
    ) -> SpectralImage:
        """Sweep the paths into an image; nothing is traced.

        Parameters
        ----------
        wavelengths : Wavelengths, str or array_like of shape (N,), optional
            Grid in nm, see `fluorspar.render`; default: that of the job. On another grid the image is as right, but
            not the one that `fluorspar.render` makes with the same seed: Russian roulette follows the brightest band.
        stokes, excitation, component_errors, threads, output, progress : optional
            See `fluorspar.render`; default: as traced.

        Returns
        -------
        SpectralImage
            Without arguments the image of `fluorspar.render`, bit for bit.

        Examples
        --------
        >>> import fluorspar
        >>> paths = fluorspar.trace("cornell-box", size=(16, 16), spp=4)
        >>> paths.image(wavelengths="400:700:100").dataset.wavelength.values.tolist()
        [400.0, 500.0, 600.0, 700.0]
        """
        job = replace(
            self.job,
            grid=self.job.grid if wavelengths is None else read_grid(wavelengths),
            stokes=self.job.stokes if stokes is None else stokes,
            excitation=self.job.excitation if excitation is None else excitation,
            component_errors=self.job.component_errors if component_errors is None else component_errors,
            threads=self.job.threads if threads is None else threads,
        )
        return render_chunks(self.chunks, job, output=output, progress=shown(progress))


def trace_job(job: RenderJob, progress: Progress | None = None) -> LightPaths:
    """Trace all light paths of a job and keep them.

    Raises
    ------
    OptionError
        If they do not fit into memory.
    """
    settings = job.scene.settings
    kept: list[Chunk] = []
    with closing(trace_chunks(job)) as chunks:
        for chunk in chunks:
            try:
                kept.append(chunk.compact())
            except MemoryError as err:
                raise OptionError(
                    message(
                        "the light paths do not fit into memory",
                        got=f"{settings.width} x {settings.height} pixels, {settings.spp} samples",
                        fix="trace fewer samples or a smaller image, or render without keeping the paths",
                    )
                ) from err
            if progress:
                progress(chunk.first_pixel + chunk.pixels, settings.width * settings.height)
    return LightPaths(job, tuple(kept))
