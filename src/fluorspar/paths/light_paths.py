"""`LightPaths`: the traced light paths of a scene, kept, to be asked for images."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from fluorspar.bispectral.donaldson import Stokes
from fluorspar.bispectral.material import Material
from fluorspar.errors import OptionError, message
from fluorspar.fingerprint import fingerprint, of_sweep
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob, read_grid
from fluorspar.notebook import explore
from fluorspar.paths.brighter import warn_of_brighter
from fluorspar.paths.first_samples import first_samples
from fluorspar.paths.log import Chunk, lanes_per_pixel
from fluorspar.paths.numbering import rows_shown
from fluorspar.paths.packed import PackedChunk, unpack
from fluorspar.paths.paths_file import PathsInFile, PathsWriter, read_paths
from fluorspar.paths.render import render_chunks
from fluorspar.paths.sweeping.gpu import chunk_on_gpu, sweeps_on_gpu
from fluorspar.progress import Progress, shown
from fluorspar.scene.lights import Light
from fluorspar.scene.relit import (
    LightSetting,
    MaterialSetting,
    exchangeable,
    in_words,
    light_ids,
    lights_in_words,
    relit,
)
from fluorspar.scene.settings import whole
from fluorspar.scene.variants import usable_cores
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["LightPaths", "load_paths"]

# Bytes of unpacked paths that are kept for the next image, in memory or in that of a GPU.
_HELD, _HELD_ON_GPU = 512 * 2**20, 2 * 2**30


@dataclass(frozen=True, repr=False, eq=False)
class LightPaths:
    """Light paths of a scene, made by `fluorspar.trace` or read by `fluorspar.load_paths`.

    They hold no spectrum: images under other lights, with other materials and on other wavelengths follow without
    tracing again.

    Attributes
    ----------
    job : RenderJob
        What was traced. Its grid is that of the images that ask for no other.
    chunks : sequence of PackedChunk
        The paths, run after run of pixels; those of a file are read when they are needed.
    """

    job: RenderJob
    chunks: Sequence[PackedChunk]
    _held: dict[int, tuple[bytes, list[Chunk]]] = field(
        default_factory=dict, init=False
    )  # by samples per pixel

    def __reduce__(self) -> tuple[Any, ...]:
        if isinstance(self.chunks, PathsInFile):
            return load_paths, (self.chunks.path,)
        return LightPaths, (self.job, self.chunks)

    @property
    def nbytes(self) -> int:
        """Size in memory, or of the file."""
        if isinstance(self.chunks, PathsInFile):
            return self.chunks.nbytes
        return sum(chunk.nbytes for chunk in self.chunks)

    @property
    def lights(self) -> tuple[Light, ...]:
        """The lights, each with its spectrum as traced."""
        return self.job.scene.lights

    @property
    def surfaces(self) -> dict[str, Material | str]:
        """What can be given another material, by shape or BSDF id: its material as traced; or why it cannot."""
        return exchangeable(self.job.scene)

    @property
    def pixels(self) -> int:
        """How many pixels there are paths of: fewer than the image has if tracing was interrupted."""
        if isinstance(self.chunks, PathsInFile):
            return self.chunks.pixels
        return sum(chunk.pixels for chunk in self.chunks)

    def __repr__(self) -> str:
        settings = self.job.scene.settings
        pixels = settings.width * settings.height
        partly = "" if self.pixels == pixels else f", {self.pixels} of {pixels} pixels traced"
        where = f" in {self.chunks.path}" if isinstance(self.chunks, PathsInFile) else ""
        return (
            f"<LightPaths of '{self.job.scene.name}': {settings.width} x {settings.height} pixels, "
            f"{settings.spp} samples, seed {self.job.seed}, "
            f"variant {self.job.variant}{partly}; {self.nbytes / 2**20:.0f} MiB{where}, "
            f"{self.nbytes / (self.pixels * settings.spp):.0f} B a sample>"
        )

    def image(
        self,
        *,
        lights: Mapping[str, LightSetting] | None = None,
        materials: Mapping[str, MaterialSetting] | None = None,
        concentration: Mapping[str, float] | None = None,
        same_luminance: bool = False,
        library: Sequence[str | Path] = (),
        wavelengths: Wavelengths | str | ArrayLike | None = None,
        stokes: Stokes | None = None,
        excitation: str | None = None,
        component_errors: bool | None = None,
        samples: int | None = None,
        threads: int | None = None,
        output: str | os.PathLike[str] | None = None,
        progress: Progress | bool | None = None,
    ) -> SpectralImage:
        """Sweep the paths into an image; nothing is traced.

        Parameters
        ----------
        lights : mapping of str to str, path, Spectrum, float or (spectrum, float), optional
            Other lights, by the id of the light or of the shape that it is on: the name of an illuminant, a file, a
            `Spectrum`, a factor on the light there is, or a pair of the first and a factor. An illuminant is relative:
            it gets the luminance of the light that it replaces (or its power, if that one or it is hardly visible).
            Files and spectra are taken at their word, in the unit of the light.
        materials : mapping of str to str, path or Material, optional
            Other materials, by shape or BSDF id: as in `fluorspar.render`. A coat, a mask and the like stay.
        concentration : mapping of str to float, optional
            Factors on the luminescence, by shape or BSDF id, also of a material that is exchanged.
        same_luminance : bool
            Give files and spectra the luminance of the light they replace, too.
        library : sequence of str or Path
            Folders with materials of your own, see `fluorspar.load_scene`.
        wavelengths : Wavelengths, str or array_like of shape (N,), optional
            Grid in nm, see `fluorspar.render`; default: that of the job. On another grid the image is as right, but
            not the one that `fluorspar.render` makes with the same seed: Russian roulette follows the brightest band
            that is computed. The same holds for another `excitation`.
        stokes, excitation, component_errors, threads, output, progress : optional
            See `fluorspar.render`; default: as traced.
        samples : int, optional
            Sweep only so many samples of each pixel, for a quick look, at least one of 64 traced ones; default: all.

        Returns
        -------
        SpectralImage
            Without arguments the image of `fluorspar.render`, bit for bit. With other lights and materials unbiased:
            roulette has followed the old ones, as have shadow rays among more than four lights, and their chances are
            part of the paths. Attribute `relit` says what was changed, and `lights`, as of `fluorspar.render`, what
            the lights are.

        Raises
        ------
        OptionError
            If there is no such light, shape or BSDF, or its material cannot be exchanged; see `surfaces`.
        MaterialError, SpectrumError
            If a material or light is unknown or impossible.
        PathsError
            If the paths come from a file that is damaged.

        Warns
        -----
        FluorsparWarning
            If a material is so much brighter than the one it replaces that long paths become noisy.

        Examples
        --------
        >>> import fluorspar
        >>> paths = fluorspar.trace("cornell-box", size=(16, 16), spp=4)
        >>> image = paths.image(lights={"light": "D50"}, materials={"left-wall": "poster-orange"})
        >>> image.attrs["relit"]
        {'lights': {'light': 'D50'}, 'materials': {'left-wall': 'poster-orange'}}
        """
        scene = relit(
            self.job.scene,
            lights=lights,
            materials=materials,
            concentration=concentration,
            same_luminance=same_luminance,
            library=library,
        )
        changes = {"lights": lights, "materials": materials, "concentration": concentration}
        said = {
            what: {key: in_words(value) for key, value in of.items()} for what, of in changes.items() if of
        }
        if samples is not None:
            traced, samples = self.job.scene.settings.spp, whole("samples", samples)
            if samples < 1:
                raise OptionError(
                    message("the number of samples is out of range", got=samples, expected="1 or more")
                )
            scene = scene.with_settings(spp=min(max(samples, lanes_per_pixel(traced)), traced))
        if same_luminance and lights:
            said["same_luminance"] = {"lights": "yes"}
        job = replace(
            self.job,
            scene=scene,
            relit=said,
            changed_lights=lights_in_words(scene, lights, same_luminance, self.job.changed_lights),
            grid=self.job.grid if wavelengths is None else read_grid(wavelengths),
            stokes=self.job.stokes if stokes is None else stokes,
            excitation=self.job.excitation if excitation is None else excitation,
            component_errors=self.job.component_errors if component_errors is None else component_errors,
            threads=self.job.threads if threads is None else threads,
        )
        if materials or concentration:
            warn_of_brighter(self.job, job)
        as_traced = not said and wavelengths is None and excitation is None and samples is None
        label = self.fingerprint if as_traced else None
        if label is not None:
            label = label | of_sweep(job)
        return render_chunks(self._unpacked(job), job, output=output, label=label, progress=shown(progress))

    @property
    def fingerprint(self) -> dict[str, str] | None:
        """Of the job, see `fluorspar.fingerprint`; None where it is not known."""
        if isinstance(self.chunks, PathsInFile):
            return self.chunks.fingerprint
        return fingerprint(self.job)

    def light_images(
        self, *, lights: Mapping[str, LightSetting] | None = None, **options: Any
    ) -> dict[str, SpectralImage]:
        """Sweep the paths into one image for each light, in which it alone is on; they add up to the whole.

        Parameters
        ----------
        lights, **options
            As in `image`.

        Returns
        -------
        dict of str to SpectralImage
            By the names of `lights`.

        Examples
        --------
        >>> import fluorspar
        >>> list(fluorspar.trace("cornell-box", size=(8, 8), spp=1).light_images())
        ["shape 'light' (obj)"]
        """
        rows = light_ids(self.job.scene)
        images = {}
        for row, light in enumerate(self.lights):
            its_own = {key: setting for key, setting in (lights or {}).items() if rows.get(key, row) == row}
            dark = {other.name: 0.0 for other in self.lights if other is not light}
            images[light.name] = self.image(lights=its_own | dark, **options)
        return images

    def explore(self, *, height: int = 720, port: int = 0) -> Any:
        """Open the window of `fluorspar view` on the paths, as `SpectralImage.explore` does."""
        return explore(self, height=height, port=port)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the paths to a file, by custom `.paths`: HDF5, with everything that images are made of.

        Raises
        ------
        ImageError
            If the file cannot be written; an older one of that name is then unchanged.

        Examples
        --------
        >>> import fluorspar, tempfile
        >>> file = Path(tempfile.mkdtemp()) / "box.paths"
        >>> fluorspar.trace("cornell-box", size=(8, 8), spp=4).save(file)
        >>> fluorspar.load_paths(file).image().dataset.radiance.shape
        (7, 8, 8, 69)
        """
        with PathsWriter(path, self.job, self.fingerprint) as writer:
            for chunk in self.chunks:
                writer.write(chunk)
            writer.keep()

    def _unpacked(self, job: RenderJob) -> Iterator[Chunk]:
        """Go through the chunks, with the rows of the scene of a job; keep them for the next image if they are few."""
        row_of, beyond = rows_shown(self.job.scene, job.scene)
        key = row_of.tobytes() + str(beyond).encode()
        traced, spp = self.job.scene.settings.spp, job.scene.settings.spp
        for samples in (traced, spp):
            shown_as, chunks = self._held.get(samples, (b"", []))
            if shown_as == key:
                yield from chunks
                return
        held: list[Chunk] | None = []
        on_gpu = sweeps_on_gpu(job.variant)
        with ThreadPoolExecutor(job.threads or usable_cores()) as pool:
            for packed in self.chunks:
                chunk = unpack(packed, row_of, beyond, pool)
                if spp < traced:
                    chunk = first_samples(chunk, spp)
                if on_gpu:
                    chunk = chunk_on_gpu(chunk)
                if held is not None:
                    held.append(chunk)
                    if sum(each.log.nbytes for each in held) > (_HELD_ON_GPU if on_gpu else _HELD):
                        held = None
                yield chunk
        if held is not None:
            for other in self._held.keys() - {traced}:
                self._held.pop(other, None)  # other threads do so too
            self._held[spp] = key, held


def load_paths(path: str | os.PathLike[str]) -> LightPaths:
    """Open a file of light paths, written by `LightPaths.save` or `fluorspar trace`.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    LightPaths
        Its chunks are read when they are needed, so they need not fit into memory.

    Raises
    ------
    PathsError
        If the file is missing, is none of light paths, of another version, or damaged.
    """
    return LightPaths(*read_paths(path))
