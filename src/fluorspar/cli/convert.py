"""`fluorspar convert`: a spectral image into another format, fewer components or other wavelengths."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.given import exposure_of, white_of
from fluorspar.cli.options import A_COMPONENT, ExposureOption
from fluorspar.cli.outputs import say_written, warn_of_envi, writing
from fluorspar.image.formats.registry import SUFFIXES, SUFFIXES_WRITTEN

__all__ = ["convert"]

_EXAMPLES = """Examples:

  fluorspar convert box.nc box.exr

  fluorspar convert pbrt.exr pbrt.nc --wavelengths 400:700:10

  fluorspar convert box.nc small.nc --total --compress

  fluorspar convert mitsuba.exr bands.nc --channel-wavelengths 400:700:10

  fluorspar convert box.nc luminescence.hdr --component luminescent

\b
  fluorspar convert box.nc direct.png \\
      --component direct_luminescence+direct_reflection --exposure box.nc

  fluorspar convert box.nc box.png --white A"""


def convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help=f"A spectral image ({', '.join(SUFFIXES)}).")],
    target: Annotated[
        Path, typer.Argument(metavar="OUT", help=f"File to write: {', '.join(SUFFIXES_WRITTEN)}.")
    ],
    component: Annotated[
        str | None,
        typer.Option(help=f"Write only {A_COMPONENT}"),
    ] = None,
    total: Annotated[bool, typer.Option("--total", help="Write only the sum of all components.")] = False,
    wavelengths: Annotated[
        str | None,
        typer.Option(
            metavar="START:STOP:STEP", help="Write other wavelengths, in nm. [default: those of the image]"
        ),
    ] = None,
    bandwidth: Annotated[
        float,
        typer.Option(
            help="Write triangular bands of this width (FWHM, nm), at least that of the image; 0: interpolate linearly."
        ),
    ] = 0.0,
    compress: Annotated[
        bool,
        typer.Option(
            "--compress", help="Of a .nc file: less than half the size, without loss, but slower to write."
        ),
    ] = False,
    channel_wavelengths: Annotated[
        str | None,
        typer.Option(
            metavar="START:STOP:STEP|A,B,...",
            help="Wavelengths in nm of the channels of an .exr whose names hold none, in the order of the "
            "numbers in the names.",
        ),
    ] = None,
    white: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|X,Y,Z",
            help="Of a .png: the white that the eye is adapted to (Bradford): an illuminant, or XYZ. "
            "[default: not adapted]",
        ),
    ] = None,
    exposure: ExposureOption = None,
) -> None:
    """Convert a spectral image into another format, a picture, some components or other wavelengths."""
    from fluorspar.cli.targets import check_files
    from fluorspar.errors import OptionError, message
    from fluorspar.files.names import text_of
    from fluorspar.files.writing import check_not_input
    from fluorspar.image.converted import ASSUMED, converted
    from fluorspar.image.display.picture import write_png
    from fluorspar.image.formats.envi import data_file
    from fluorspar.image.spectral_image import SpectralImage
    from fluorspar.image.units import unit_of
    from fluorspar.spectral.wavelengths import Wavelengths

    check_files([target], SUFFIXES_WRITTEN)
    if component is not None and total:
        raise OptionError(message("--component and --total exclude each other"))
    kind = target.suffix.lower()
    if compress and kind != ".nc":
        raise OptionError(
            message("only a NetCDF file (.nc) can be written with --compress", where="--compress", got=target)
        )
    if white is not None and kind != ".png":
        raise OptionError(message("only a picture is adapted to a white", where="--white", got=target))
    adapted = None if white is None else white_of(white)
    sources = (source, data_file(source) if source.suffix.lower() == ".hdr" else None)
    for written in (target, target.with_suffix(".img")) if kind == ".hdr" else (target,):
        check_not_input(written, *sources, fault="an image cannot be converted onto itself")
    grid = Wavelengths.parse(wavelengths) if wavelengths else None
    channels = None if channel_wavelengths is None else _wavelengths_of(channel_wavelengths)
    with (
        SpectralImage.open(source, channel_wavelengths=channels) as image,
        writing(target),
    ):
        factor = exposure_of(exposure, [target], white=adapted, unit=unit_of(image.attrs))
        result = converted(image, "total" if total else component, grid, bandwidth)
        if ASSUMED in str(result.attrs.get("converted", "")) and ASSUMED not in str(
            image.attrs.get("converted", "")
        ):
            console.warning(f"{text_of(source)}: {ASSUMED}")
        used = None
        if kind == ".png":
            if isinstance(factor, str):  # that of all components
                factor = float(image.srgb(white=adapted).attrs["exposure"])
            used = write_png(result.dataset, target, exposure=factor, white=adapted)
        else:
            result.save(target, compress=compress)
        warn_of_envi(result, target)
    say_written(target, result, used)


def _wavelengths_of(text: str) -> list[float]:
    """Wavelengths given as a grid or one by one, in nm."""
    from fluorspar.errors import OptionError, message
    from fluorspar.spectral.wavelengths import Wavelengths

    if ":" in text:
        return [float(wavelength) for wavelength in Wavelengths.parse(text).values]
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as err:
        expected = "START:STOP:STEP or A,B,C in nm, such as 400:700:10 or 365,405,450"
        raise OptionError(
            message(
                "wavelengths are not readable",
                where="--channel-wavelengths",
                got=repr(text),
                expected=expected,
            )
        ) from err


convert.__doc__ = f"{convert.__doc__}\n\n{_EXAMPLES}"
