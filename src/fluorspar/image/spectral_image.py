"""A spectral image split into components: the result of every render."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.colour.observers import CIE_1931, observer_named
from fluorspar.errors import ImageError, OptionError, message
from fluorspar.image.components import COMPONENTS, select
from fluorspar.image.dataset import (
    add_up,
    check_dataset,
    decoded_attrs,
    grid_of,
    load,
    make_dataset,
    names_of,
    readable,
    variable_attrs,
)
from fluorspar.image.units import is_radiance
from fluorspar.notebook import explore
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    import xarray as xr

    from fluorspar.image.summary import Summary

__all__ = ["SpectralImage"]

_Choice = str | Iterable[str] | None


class SpectralImage:
    """The radiance of every pixel at every wavelength, split into components.

    An image opened from a NetCDF file, a Zarr store or a large ENVI file stays there; methods read the rows and
    components they need.

    Parameters
    ----------
    dataset : Dataset
        `radiance(component, y, x, wavelength)`, float32, in W m-2 sr-1 nm-1, y = 0 at the top; optionally
        `standard_error(y, x, wavelength)` of the total and `component_standard_error`.

    Raises
    ------
    ImageError
        If the data set is laid out differently.

    See Also
    --------
    fluorspar.image.components : what the components are.

    Examples
    --------
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths(), attrs={"spp": 16})
    >>> image.total().shape
    (4, 6, 69)
    >>> float(image.luminescent().max())
    3.0
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self.dataset = check_dataset(dataset)
        self._summary: Summary | None = None

    @classmethod
    def from_arrays(
        cls,
        radiance: ArrayLike,
        wavelengths: Wavelengths,
        standard_error: ArrayLike | None = None,
        attrs: Mapping[str, Any] | None = None,
        *,
        component_standard_error: ArrayLike | None = None,
        components: Sequence[str] = COMPONENTS,
    ) -> SpectralImage:
        """Make an image of plain arrays; float32 arrays are not copied.

        Parameters
        ----------
        radiance : array_like of shape (C, Y, X, N)
            W m-2 sr-1 nm-1.
        wavelengths : Wavelengths
            The N wavelengths.
        standard_error : array_like of shape (Y, X, N), optional
            Of the total.
        attrs : mapping, optional
            Numbers and strings are kept; anything else is kept as JSON.
        component_standard_error : array_like of shape (C, Y, X, N), optional
            Of each component.
        components : sequence of str
            The C names, those of `COMPONENTS` unless one is missing; or `TOTAL` alone, for an image not split.

        Raises
        ------
        ImageError
            If the shapes do not match.
        """
        return cls(
            make_dataset(
                radiance,
                wavelengths,
                standard_error,
                attrs,
                component_standard_error=component_standard_error,
                components=components,
            )
        )

    @classmethod
    def open(
        cls, path: str | os.PathLike[str], *, channel_wavelengths: Sequence[float] | None = None
    ) -> SpectralImage:
        """Open an image: NetCDF (`.nc`) or Zarr (`.zarr`), read when used, spectral EXR (`.exr`) or ENVI (`.hdr`).

        An ENVI file of more than 1 GiB is read when used, too; an EXR file must fit into memory.
        EXR files of other programs and ENVI files hold an image that is not split: its one component is `total`.

        Parameters
        ----------
        path : str or path-like
        channel_wavelengths : sequence of float, optional
            Wavelengths in nm of the channels of an EXR file whose names hold none, in the order of the numbers in
            their names.

        Raises
        ------
        ImageError
            If the file is missing, truncated, of another kind, or not a spectral image.

        Warns
        -----
        ApproximationWarning
            If something in the file is not read, or had to be assumed.

        Examples
        --------
        >>> SpectralImage.open("room.png")
        Traceback (most recent call last):
        ...
        fluorspar.errors.ImageError: a spectral image cannot be read from this kind of file
          where:    room.png
          got:      .png
          expected: .nc, .exr, .hdr, .zarr
        """
        from fluorspar.image.formats.registry import read_image

        return cls(read_image(path, channel_wavelengths))

    def save(self, path: str | os.PathLike[str], *, compress: bool = False) -> None:
        """Write the image: `.nc`, `.zarr` and `.exr` without loss, the total to `.hdr` (ENVI), its picture to `.png`.

        Parameters
        ----------
        path : str or path-like
            The file to be written or replaced; its suffix picks the format.
        compress : bool
            Pack a NetCDF file without loss: less than half the size, but written about eight times as slowly.

        Raises
        ------
        ImageError
            If the suffix is none of these or the file cannot be written; an older file is then unchanged.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
        >>> path = Path(tempfile.mkdtemp()) / "room.nc"
        >>> image.save(path)
        >>> SpectralImage.open(path).shape
        (7, 4, 6, 69)
        """
        from fluorspar.image.formats.registry import write_image

        write_image(self.dataset, path, compress)

    def load(self) -> SpectralImage:
        """Read all of the image into memory; return it.

        Raises
        ------
        ImageError
            If it does not fit, or the file is damaged.
        """
        load(self.dataset)
        return self

    def close(self) -> None:
        """Let go of the file the image was opened from."""
        self.dataset.close()

    def __enter__(self) -> SpectralImage:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def wavelengths(self) -> Wavelengths:
        """The wavelength grid."""
        return grid_of(self.dataset)

    @property
    def components(self) -> tuple[str, ...]:
        """The names of the components, in their order."""
        return names_of(self.dataset)

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Numbers of components, rows, columns and wavelengths."""
        count, height, width, bands = self.dataset["radiance"].shape
        return count, height, width, bands

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.shape[2], self.shape[1]

    @property
    def attrs(self) -> dict[str, Any]:
        """The attributes of the data set, those kept as JSON turned into dicts and lists; a copy."""
        return decoded_attrs(self.dataset.attrs)

    def component(self, name: str) -> xr.DataArray:
        """One component.

        Parameters
        ----------
        name : str
            One of `components`.

        Returns
        -------
        DataArray
            Dims y, x, wavelength; W m-2 sr-1 nm-1.

        Raises
        ------
        OptionError
            If the image has no such component; the message lists those it has.

        Examples
        --------
        >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
        >>> image.component("reexcitation").dims
        ('y', 'x', 'wavelength')
        """
        (name,) = select([name], self.components)
        return self.dataset["radiance"].isel(component=self.components.index(name))

    def total(self, single_bounce: bool = False) -> xr.DataArray:
        """The sum of all components.

        Parameters
        ----------
        single_bounce : bool
            Leave out light that luminesced more than once: the paper's Eq. 13, and the visible lamp.

        Returns
        -------
        DataArray
            Dims y, x, wavelength; W m-2 sr-1 nm-1. The sum is taken in float32 and in the order of the
            components.

        Examples
        --------
        >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
        >>> float(image.total().max()), float(image.total(single_bounce=True).max())
        (7.0, 6.0)
        """
        return self._sum("single_bounce" if single_bounce else "total")

    def reflected(self) -> xr.DataArray:
        """Light that never luminesced, components 1 + 3 (the paper's Figure 12); dims y, x, wavelength."""
        return self._sum("reflected")

    def luminescent(self) -> xr.DataArray:
        """Light that luminesced once, components 2 + 4 + 5 (the paper's Figure 12); dims y, x, wavelength."""
        return self._sum("luminescent")

    def standard_error(self) -> xr.DataArray:
        """The standard error of the total; dims y, x, wavelength.

        Raises
        ------
        ImageError
            If the image holds none.
        """
        if "standard_error" not in self.dataset:
            raise ImageError(message("the image holds no standard error"))
        return self.dataset["standard_error"]

    def xyz(self, component: _Choice = None, *, observer: str | int = CIE_1931) -> xr.DataArray:
        """CIE tristimulus values.

        Parameters
        ----------
        component : str or list of str, optional
            A component, several that are added up (a list, or text joined by "+"), or `total`, `single_bounce`,
            `reflected`, `luminescent`.
        observer : str or int
            As for `fluorspar.colour.observers.observer_named`: 2, 10 or a name.

        Returns
        -------
        DataArray
            Dims y, x, tristimulus (X, Y, Z); 683 lm/W times the sums over the wavelengths of the image. Y is
            in cd/m2 if the observer is that of CIE 1931 and the image holds radiance in W m-2 sr-1 nm-1.

        Raises
        ------
        OptionError
            If there is no such component or observer.

        Examples
        --------
        >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
        >>> image.xyz("reflected").dims
        ('y', 'x', 'tristimulus')
        """
        from fluorspar.image.display.appearance import xyz_of

        observer = observer_named(observer)
        xyz = xyz_of(self.dataset, select(component, self.components), observer)
        units = "cd m-2" if observer == CIE_1931 and is_radiance(self.dataset.attrs) else "relative"
        return _labelled(xyz, "tristimulus", ["X", "Y", "Z"], f"tristimulus values, {observer}", units)

    def luminance(self, component: _Choice = None) -> xr.DataArray:
        """Luminance in cd/m2, that of the CIE 1931 observer; relative if the image does not hold radiance.

        Parameters
        ----------
        component : str or list of str, optional
            As in `xyz`.

        Returns
        -------
        DataArray
            Dims y, x.

        Examples
        --------
        >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
        >>> image.luminance().attrs["units"]
        'cd m-2'
        """
        luminance = self.xyz(component).isel(tristimulus=1, drop=True)
        luminance.attrs["long_name"] = "luminance"
        return luminance

    def srgb(
        self,
        component: _Choice = None,
        exposure: float | None = None,
        *,
        white: str | ArrayLike | None = None,
    ) -> xr.DataArray:
        """The image as a display shows it.

        Parameters
        ----------
        component : str or list of str, optional
            As in `xyz`.
        exposure : float, optional
            Factor on luminance, m2/cd: 1 / exposure cd/m2 is white. By default the brightest of linear R, G,
            B is 1 at the 99th percentile of the pixels that are not black, `source` left out. Give the same
            number for pictures that are to be compared.
        white : str or array_like of shape (3,), optional
            The white that the eye is adapted to, shown as the white of the display: an illuminant, or XYZ of
            any scale (linear Bradford transform). Default: no adaptation.

        Returns
        -------
        DataArray
            Dims y, x, channel (R, G, B); float32 from 0 to 1 with the sRGB transfer curve, NaN where nothing
            was rendered. Attributes: `exposure`, the one used, and `out_of_gamut`, the share of pixels that
            sRGB cannot show as they are: they are shown less saturated, or white.

        Raises
        ------
        OptionError
            If there is no such component, or the exposure or the white is impossible.

        Examples
        --------
        >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
        >>> picture = image.srgb()
        >>> picture.shape
        (4, 6, 3)
        >>> same_scale = image.srgb("direct_luminescence", exposure=picture.exposure)
        """
        from fluorspar.image.display.appearance import appearance

        shown = appearance(self.dataset, select(component, self.components), exposure, white=white)
        picture = _labelled(shown.rgb, "channel", ["R", "G", "B"], "sRGB", "1")
        picture.attrs.update(exposure=shown.exposure, out_of_gamut=shown.out_of_gamut)
        return picture

    def spectrum_at(self, x: int, y: int) -> xr.Dataset:
        """The spectra of one pixel.

        Parameters
        ----------
        x, y : int
            Column from the left and row from the top, from 0; negative numbers count from the other side.

        Returns
        -------
        Dataset
            `radiance(component, wavelength)`, `total(wavelength)` and what standard errors there are.

        Raises
        ------
        OptionError
            If the pixel is outside the image.

        Examples
        --------
        >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
        >>> float(image.spectrum_at(5, 3).total.sel(wavelength=550))
        7.0
        """
        width, height = self.size
        if not (-width <= x < width and -height <= y < height):
            raise OptionError(
                message(
                    "the pixel is outside the image",
                    got=f"x = {x}, y = {y}",
                    expected=f"x from 0 to {width - 1}, y from 0 to {height - 1}",
                )
            )
        with readable(self.dataset.encoding.get("source")):
            pixel = self.dataset.isel(x=x, y=y).load()
        # one by one, as in total(): numpy's sum may add in another order
        total = np.zeros(len(self.wavelengths), np.float32)
        for component in pixel["radiance"].values:
            total += component
        attrs = variable_attrs("radiance", pixel.attrs)
        return pixel.assign(total=("wavelength", total, attrs | {"long_name": f"total {attrs['long_name']}"}))

    def denoised(self, *, scene: Any = None, threads: int | None = None) -> SpectralImage:
        """The image without its noise: Open Image Denoise on channels of all components and of their sum.

        Spectra stay spectra: the mean radiance in a few ranges of wavelengths is denoised, and what that changes is
        put back as the spectra that go with it in this image. Lamps seen directly are left as they are, and what no
        channel holds; components still add up. Where the noise is known to be smaller than what the denoiser is off,
        the noisy image counts.

        Parameters
        ----------
        scene : Scene, str or path, optional
            What the image was rendered from, whose surfaces tell where edges are; the image knows a built-in one.
            Without a scene edges between materials may be softened.
        threads : int, optional
            Default: all cores this process may use.

        Returns
        -------
        SpectralImage
            Attribute `denoised` says how. In place of standard errors it has `denoised_error(y, x, wavelength)`, the
            estimated error of the total, which neighbouring pixels share, and `noisy_standard_error`, that of the
            total before. Where it is dark, radiance may be slightly negative. An image of more than 1 GiB is not kept
            in memory: it reads this one whenever it is used.

        Raises
        ------
        FluorsparError
            If the package is missing: `pip install "fluorspar[denoise]"`.
        ImageError
            If the image is denoised already.
        SceneError
            If the scene cannot be loaded.

        Examples
        --------
        >>> import fluorspar
        >>> image = fluorspar.render("cornell-box", size=(32, 32), spp=4).denoised()
        >>> image.attrs["denoised"]
        'Open Image Denoise, guided by colours and normals of surfaces'
        """
        # above the scene that it may need: imported by name, and when it is asked for
        denoise = import_module("fluorspar.denoising.denoise").denoise
        clean: SpectralImage = denoise(self, scene=scene, threads=threads)
        return clean

    def explore(self, *, height: int = 720, port: int = 0) -> Any:
        """Open the window of `fluorspar view` on the image; a notebook shows it in a frame.

        Parameters
        ----------
        height : int
            Of the frame, in pixels.
        port : int
            Of the server, which is in the background; 0: any that is free.

        Returns
        -------
        Frame
            Its `address` is for a browser on this computer; `close()` ends the server.

        Raises
        ------
        FluorsparError
            If the server's packages are missing: `pip install "fluorspar[view]"`.

        Examples
        --------
        >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
        >>> window = image.explore()
        >>> window.address.startswith("http://127.0.0.1:")
        True
        >>> window.close()
        """
        return explore(self, height=height, port=port)

    def _sum(self, group: str) -> xr.DataArray:
        import xarray as xr

        values = add_up(self.dataset, select(group, self.components))
        attrs = variable_attrs("radiance", self.dataset.attrs)
        return xr.DataArray(
            values,
            {"wavelength": self.dataset["wavelength"]},
            ("y", "x", "wavelength"),
            name=group,
            attrs=attrs | {"long_name": f"{group.replace('_', ' ')} {attrs['long_name']}"},
        )

    def _summarised(self) -> Summary:
        if self._summary is None:
            from fluorspar.image.summary import summarise

            self._summary = summarise(self.dataset)
        return self._summary

    def __repr__(self) -> str:
        return self._summarised().text()

    def _repr_html_(self) -> str:
        return self._summarised().html(self._repr_png_())

    def _repr_png_(self) -> bytes:
        from fluorspar.image.display.picture import png_bytes, thumbnail

        return png_bytes(thumbnail(self.dataset))


def _labelled(values: NDArray[Any], dim: str, labels: list[str], long_name: str, units: str) -> xr.DataArray:
    import xarray as xr

    return xr.DataArray(
        values, {dim: labels}, ("y", "x", dim), attrs={"units": units, "long_name": long_name}
    )
