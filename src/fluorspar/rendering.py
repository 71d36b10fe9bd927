"""The public functions: a scene and options in, a spectral image or its light paths out."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from fluorspar.bispectral.donaldson import Stokes
from fluorspar.bispectral.material import Material
from fluorspar.errors import OptionError, message
from fluorspar.image.pixels import check_streamed
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob
from fluorspar.progress import Progress, shown
from fluorspar.scene.relit import LightSetting
from fluorspar.scene.scene import Scene
from fluorspar.scene.viewpoint import ViewpointSetting
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.until import Until

if TYPE_CHECKING:
    from distributed import Client

    from fluorspar.paths.light_paths import LightPaths
    from fluorspar.paths.render import Fill
    from fluorspar.staged.options import StagedOptions
    from fluorspar.staged.renderers.protocol import Renderer

__all__ = ["render", "render_job", "trace"]


def render(
    scene: Scene | str | Path | dict[str, Any],
    *,
    spp: int | None = None,
    seed: int = 0,
    wavelengths: Wavelengths | str | ArrayLike | None = None,
    method: str = "paths",
    size: tuple[int, int] | None = None,
    max_depth: int | None = None,
    rr_depth: int | None = None,
    materials: Mapping[str, str | Path | Material] | None = None,
    camera: ViewpointSetting | None = None,
    lights: Mapping[str, LightSetting] | None = None,
    same_luminance: bool = False,
    stokes: Stokes = "half",
    excitation: str = "full",
    component_errors: bool = False,
    until: str | None = None,
    max_time: str | float | None = None,
    variant: str = "auto",
    threads: int | None = None,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    more_samples: int | None = None,
    progress: Progress | bool | None = None,
    staged: StagedOptions | None = None,
    renderer: Renderer | str | None = None,
    client: Client | None = None,
) -> SpectralImage:
    """Render a scene into a spectral image, split into components.

    Parameters
    ----------
    scene : Scene, str, path or dict
        A scene of `load_scene`, or what `load_scene` takes.
    spp : int, optional
        Samples per pixel; default: the scene's.
    seed : int
        Same seed, same image, bit for bit, whatever the number of threads.
    wavelengths : Wavelengths, str or array_like of shape (N,), optional
        Grid in nm: a `Wavelengths`, `"START:STOP:STEP"`, or an evenly spaced array; default 360:700:5.
    method : str
        `"paths"`: all components, bands and bounces from one pass. `"staged"`: the paper's procedure on stock
        integrators, components 0 to 5.
    size : (int, int), optional
        Width and height in pixels; default: the scene's.
    max_depth, rr_depth : int, optional
        As in Mitsuba (2 is direct light only, -1 unlimited); default: the scene's.
    materials : mapping of str to str, path or Material, optional
        Materials from outside, by shape or BSDF id, for a scene that is not loaded yet.
    camera : Viewpoint, str or mapping, optional
        Another place, target or field of view of the camera, as a `fluorspar.scene.viewpoint.Viewpoint`, a dict of the
        same names, or text: `"origin=278,273,-400 target=278,100,280 fov=60"`. What is left out stays.
    lights : mapping of str to str, path, Spectrum, float or (spectrum, float), optional
        Other spectra of the lights, by the id of the light or of its shape, see `LightPaths.image`.
    same_luminance : bool
        Give files and spectra of `lights` the luminance of the light they replace, as illuminants always get it.
    stokes : str
        `"half"`: excitation at the emission wavelength itself counts half (trapezoid rule); `"strict"`: not at
        all (Eq. 1 of the paper to the letter).
    excitation : str
        `"full"`: light that the grid does not hold excites too, as far down as a light and the excitation of a
        material overlap; the attribute `excitation` says from where. `"grid"`: only the grid's own wavelengths
        excite, as in the paper.
    component_errors : bool
        Estimate the standard error of each component too, not only of the total.
    until : str, optional
        Render passes of `spp` samples or more until the relative standard error of luminance of a pixel is so small:
        `"error=1%"` on average over the pixels that show light, `"p95=2%"` at their 95th percentile; also as a
        fraction, `"error=0.01"`. The first pass is the image without this option. Attribute `until` says what was
        reached, see `fluorspar.paths.passes`.
    max_time : str or float, optional
        With `until`: begin no pass that would end after this time, but one: `"90s"`, `"10m"`, `"1.5h"`, or seconds.
    variant : str
        `"llvm"` for the processor, `"cuda"` for an NVIDIA GPU, or `"auto"`: the GPU if it starts, else the processor;
        the attribute `variant` says which. From one seed they trace the same paths up to rounding.
    threads : int, optional
        Default: all cores this process may use; with a client, of each worker, default: those it was started with.
    output : path, optional
        A `.nc` file or `.zarr` store to stream the image to while it is rendered, so that it need not fit into
        memory; the image returned then reads from it.
    resume : bool
        Go on with what an interrupted render of the same scene and options has left of `output`, if anything: after
        Ctrl-C a partial image, after anything else (from a few seconds on) its finished chunks and a journal beside
        the file. The result is the one of a render without interruption, bit for bit.
    more_samples : int, optional
        In place of `spp`: add so many samples per pixel, of further random numbers, to the finished image `output`.
    progress : callable or bool, optional
        True draws a bar, in notebooks too; or called with the work done and the work in all (pixels, or renders of the
        staged method).
    staged : StagedOptions, optional
        Options of the staged method.
    renderer : str or Renderer, optional
        What renders for the staged method: `"mitsuba"` (default), `"cycles"` (Blender, a process of its own: that of
        the environment variable `BLENDER`, else the one of the search path), or another one, see
        `fluorspar.staged.renderers.protocol`.
    client : distributed.Client, optional
        Of Dask: its workers render, and the image is the same bit for bit. They need no files of the scene.

    Returns
    -------
    SpectralImage
        `radiance(component, y, x, wavelength)`, W m-2 sr-1 nm-1, and its `standard_error`. If the user
        interrupts (Ctrl-C), what is finished is kept, the rest is NaN, and attribute `partial` is 1; of the staged
        method, whole repeats are kept, and with `until` whole passes. The same holds if the scheduler of a client is
        lost, or some pixels cannot be rendered by any worker; attribute `fault` says why.

    Raises
    ------
    SceneError, MaterialError, SpectrumError
        If the scene cannot be used, see `load_scene`.
    OptionError
        If an option is out of range.
    RendererError
        If Mitsuba's variant does not start, or Blender is missing, too old, ends or hangs.
    ClusterError
        If the scheduler of a client is lost before anything is finished, or a worker has another version or lacks the
        variant.

    Notes
    -----
    Method: section "One pass" of the documentation; components: Eqs. 3-13 of Tominaga, Guarnera, Ohtera,
    IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980. The caller's Mitsuba variant is set again afterwards.

    Examples
    --------
    >>> image = render("cornell-box", size=(16, 16), spp=4, wavelengths="400:700:20")
    >>> image.dataset.radiance.shape
    (7, 16, 16, 16)
    >>> near = render("cornell-box", size=(16, 16), spp=4, camera="fov=20", lights={"light": "A"})
    >>> near.attrs["camera"], near.attrs["lights"]
    ('fov=20', {'light': 'A'})
    """
    if more_samples is not None:
        _check_more(spp=spp, until=until)
    job = RenderJob.of(
        scene,
        materials=materials,
        camera=camera,
        lights=lights,
        same_luminance=same_luminance,
        wavelengths=wavelengths,
        size=size,
        spp=spp if more_samples is None else more_samples,
        max_depth=max_depth,
        rr_depth=rr_depth,
        seed=seed,
        method=method,
        stokes=stokes,
        excitation=excitation,
        component_errors=component_errors,
        until=Until.parse(until, max_time),
        variant=variant,
        threads=threads,
        options=staged,
    )
    if more_samples is not None:
        _check_left(job, output, "more_samples")
        from fluorspar.paths.more_samples import render_more

        assert output is not None
        fill = _fill(client)
        return render_more(job, output, resume=resume, progress=shown(progress), fill=fill)
    return render_job(job, output=output, resume=resume, progress=progress, renderer=renderer, client=client)


def _fill(client: Client | None) -> Fill:
    """Where pixels are rendered: here, or on the workers of a client."""
    if client is None:
        from fluorspar.paths.render import fill_here

        return fill_here
    from fluorspar.cluster.render_on import fill_on

    return fill_on(client)


def _check_more(**others: Any) -> None:
    """Refuse what says, beside more_samples, how many samples there shall be."""
    for name, value in others.items():
        if value is not None:
            fix = "give one of them"
            raise OptionError(message(f"both {name} and more_samples are given", got=value, fix=fix))


def _check_left(job: RenderJob, output: str | os.PathLike[str] | None, what: str) -> None:
    """Refuse to go on with an image where nothing is kept of one."""
    if job.method != "paths":
        raise OptionError(message(f"the staged method has no {what}", fix="use method 'paths'"))
    if output is None:
        expected = "output='NAME.nc', for light paths 'NAME.paths' (-o)"
        raise OptionError(message(f"{what} needs the file to continue", got="none", expected=expected))


def render_job(
    job: RenderJob,
    *,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    progress: Progress | bool | None = None,
    renderer: Renderer | str | None = None,
    client: Client | None = None,
) -> SpectralImage:
    """Render a job, which may come from another process; see `render`.

    Examples
    --------
    >>> job = RenderJob.of("cornell-box", size=(16, 16), spp=4, wavelengths="400:700:100")
    >>> render_job(job).dataset.sizes["wavelength"]
    4
    """
    if output is not None:
        check_streamed(output)
    if resume:
        _check_left(job, output, "resume")
    if renderer is not None and job.method != "staged":
        raise OptionError(
            message(
                "a renderer for the staged method is given",
                got=f"method={job.method!r}",
                expected="method='staged'",
            )
        )
    if client is not None and job.method != "paths":
        fix = "use method 'paths', or render without a scheduler"
        raise OptionError(message("the staged method has no workers", got=f"client={client!r}", fix=fix))
    if job.method == "paths":
        fill = _fill(client)
        if job.until is not None:
            from fluorspar.paths.passes import render_passes

            return render_passes(
                job, job.until, output=output, resume=resume, progress=shown(progress), fill=fill
            )
        from fluorspar.paths.render import render_paths

        return render_paths(job, output=output, resume=resume, progress=shown(progress), fill=fill)

    from fluorspar.staged.procedure import render_staged
    from fluorspar.staged.renderers.named import renderer_of

    image = render_staged(job, progress=shown(progress), renderer=renderer_of(renderer))
    if output is None:
        return image
    image.save(output)
    return SpectralImage.open(output)


def trace(
    scene: Scene | str | Path | dict[str, Any],
    *,
    spp: int | None = None,
    seed: int = 0,
    wavelengths: Wavelengths | str | ArrayLike | None = None,
    size: tuple[int, int] | None = None,
    max_depth: int | None = None,
    rr_depth: int | None = None,
    materials: Mapping[str, str | Path | Material] | None = None,
    camera: ViewpointSetting | None = None,
    lights: Mapping[str, LightSetting] | None = None,
    same_luminance: bool = False,
    excitation: str = "full",
    variant: str = "auto",
    threads: int | None = None,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> LightPaths:
    """Trace the light paths of a scene and keep them: images follow from them without tracing again.

    Parameters
    ----------
    scene, spp, seed, size, max_depth, rr_depth, materials, camera, lights, same_luminance, excitation, variant, threads
        See `render`.
    wavelengths : Wavelengths, str or array_like of shape (N,), optional
        Grid of the images, see `render`. The paths hold no wavelength, and images on other grids are as right, but
        Russian roulette follows the brightest band of this one.
    output : path, optional
        A `.paths` file to write them to while they are traced, so that they need not fit into memory.
    resume : bool
        Go on with what an interrupted run of the same scene and options has left of `output`, see `render`.
    progress : callable or bool, optional
        True draws a bar, in notebooks too; or called with the pixels done and the pixels in all.
    client : distributed.Client, optional
        Of Dask: its workers trace, and the paths are the same bit for bit. They need no files of the scene.

    Returns
    -------
    LightPaths
        About 25 bytes a sample in the Cornell box. `LightPaths.image` makes images of them. If the user interrupts
        (Ctrl-C), what is finished is kept, and the rest of an image is NaN.

    Raises
    ------
    SceneError, MaterialError, SpectrumError, OptionError, RendererError
        As `render`; OptionError also if the paths do not fit into memory.
    ImageError
        If the file cannot be written.
    ClusterError
        As `render`, also if the scheduler is lost later: with `output`, what was traced by then (from a few seconds on)
        is kept beside the file, and `resume` goes on with it.

    Examples
    --------
    >>> paths = trace("cornell-box", size=(16, 16), spp=4)
    >>> image = paths.image(wavelengths="400:700:20")
    >>> image.dataset.radiance.shape
    (7, 16, 16, 16)
    """
    job = RenderJob.of(
        scene,
        materials=materials,
        camera=camera,
        lights=lights,
        same_luminance=same_luminance,
        wavelengths=wavelengths,
        size=size,
        spp=spp,
        max_depth=max_depth,
        rr_depth=rr_depth,
        seed=seed,
        excitation=excitation,
        variant=variant,
        threads=threads,
    )
    from fluorspar.paths.trace import trace_job

    if resume:
        _check_left(job, output, "resume")
    if client is None:
        return trace_job(job, shown(progress), output, resume)
    from fluorspar.cluster.render_on import trace_on

    return trace_job(job, shown(progress), output, resume, trace_on(client))
