"""Writing a rendered image to the files the user asked for."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from fluorspar.cli import console
from fluorspar.files.names import text_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.units import is_radiance

__all__ = ["print_timings", "say_written", "warn_of_envi", "write_image", "write_outputs", "writing"]

_LARGE = 200e6


def write_outputs(
    image: SpectralImage,
    outputs: Sequence[Path],
    pictures: Path | None,
    *,
    streamed: Path | None = None,
    exposure: float | str | None = None,
) -> None:
    """Write the files, but one that the image was `streamed` to, and say what came out."""
    from fluorspar.image.display.picture import write_pictures

    console.out.print(str(image), markup=False, highlight=False)
    for path in outputs:
        if path != streamed:
            with writing(path):
                used = write_image(image, path, exposure)
            warn_of_envi(image, path)
        say_written(path, image, used if path != streamed else None)
    if pictures is not None:
        with writing(pictures):
            write_pictures(image.dataset, pictures, exposure)
        console.out.print(
            f"wrote a picture of every component into {text_of(pictures)}", markup=False, highlight=False
        )


def write_image(image: SpectralImage, path: Path, exposure: float | str | None = None) -> float | None:
    """Write a file; return the exposure of a picture."""
    from fluorspar.image.display.picture import write_png

    if path.suffix.lower() == ".png":
        return write_png(image.dataset, path, exposure=None if isinstance(exposure, str) else exposure)
    image.save(path)
    return None


def writing(path: Path) -> AbstractContextManager[object]:
    """Show, on a terminal, that a file is being written."""
    from rich.text import Text

    return console.err.status(Text(f"writing {text_of(path)}"))


def warn_of_envi(image: SpectralImage, path: Path) -> None:
    """Say so if a file that was written holds the total of an image that is split into components."""
    if path.suffix.lower() == ".hdr" and len(image.components) > 1:
        console.warning("an ENVI file holds one quantity: the total was written (see --component)")


def say_written(path: Path, image: SpectralImage | None = None, exposure: float | None = None) -> None:
    """Say which file was written: of a picture its exposure, of a large NetCDF file how it can be made smaller."""
    size = path.stat().st_size
    note = ""
    if image is not None and exposure is not None:
        white = f"{1 / exposure:.4g}{' cd/m2' if is_radiance(image.dataset.attrs) else ', relative'}"
        note = f" (white is {white}: exposure {exposure:.6g})"
    if path.suffix.lower() == ".nc" and size >= _LARGE:
        note = f" ({size / 1e6:,.0f} MB; 'fluorspar convert' with --total or --compress makes it smaller)"
    console.out.print(f"wrote {text_of(path)}{note}", markup=False, highlight=False)


def print_timings(image: SpectralImage) -> None:
    """Print how long each pass took."""
    timings = image.attrs.get("timings", {})
    if "component 1" in timings:
        from fluorspar.staged.timings import timing_table

        console.out.print(timing_table(timings), markup=False, highlight=False)
    else:
        for name, seconds in timings.items():
            console.out.print(f"{name:<22}{seconds:>8.2f} s", markup=False, highlight=False)
