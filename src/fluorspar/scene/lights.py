"""Which lights a scene may hold, and the spectrum of each."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, FluorsparError, SceneError, message
from fluorspar.scene.averages import average_light
from fluorspar.scene.node_checks import LARGEST
from fluorspar.scene.nodes import label
from fluorspar.scene.plugin_spectra import SpatialVariation, plugin_spectrum
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.spectral.illuminants import without_noise
from fluorspar.spectral.spectrum import Spectrum

__all__ = [
    "LIGHTS",
    "Light",
    "check_light",
    "give_spectrum",
    "light_names",
    "read_light",
    "spectrum_property",
]

LIGHTS = {
    "area": ("radiance", "W m-2 sr-1 nm-1"),
    "constant": ("radiance", "W m-2 sr-1 nm-1"),
    "point": ("intensity", "W sr-1 nm-1"),
    "spot": ("intensity", "W sr-1 nm-1"),
    "directional": ("irradiance", "W m-2 nm-1"),
}
"""Emitter plugins, the property that holds their spectrum, and its unit. Another kind of light needs a row here."""

_DEFAULT = 1.0  # Mitsuba's, where a scene gives no spectrum
_AVERAGED = ("envmap", "sunsky")  # environments that `matte` turns into a constant one


@dataclass(frozen=True)
class Light:
    """A light source and its spectral power distribution.

    Attributes
    ----------
    name : str
        Id of the emitter, or the shape it is on.
    plugin : str
        One of `LIGHTS`, or an environment that is rendered as its average.
    spectrum : Spectrum
        The radiance, intensity or irradiance that Mitsuba gives this kind of light.
    unit : str
        Says which.
    node : int
        Number of the emitter in `Scene.nodes`.
    """

    name: str
    plugin: str
    spectrum: Spectrum
    unit: str
    node: int


def spectrum_property(light: Light) -> str:
    """Name of the property that holds a light's spectrum when it is rendered."""
    return LIGHTS.get(light.plugin, LIGHTS["constant"])[0]


def give_spectrum(props: Any, light: Light, spectrum: Any) -> None:
    """Give a light another spectrum; one that is rendered as its average becomes a `constant` light.

    Parameters
    ----------
    props : mitsuba.Properties
        Those of its node, to be changed.
    light : Light
    spectrum : float or mitsuba.ScalarColor3f
        What Mitsuba takes as a spectrum in the variant that is set.
    """
    if light.plugin not in LIGHTS:
        for key in list(props.keys()):
            del props[key]
        props.set_plugin_name("constant")
    props[spectrum_property(light)] = spectrum


def light_names(state: Any, index: int, shape: int | None) -> tuple[str, str]:
    """The name of an emitter node, and how messages say where it is."""
    own = label(state.nodes[index], index)
    on = None if shape is None else label(state.nodes[shape], shape)
    name = state.nodes[index].props.id() or (own if on is None else f"shape {on}")
    return name, f"light {own}" if on is None else f"light {own} of shape {on}"


def read_light(state: Any, index: int, shape: int | None, *, matte: bool) -> Light:
    """Read an emitter node.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    index : int
        The node.
    shape : int or None
        The node of the shape that it is on.
    matte : bool
        Render a light that varies as one of its average radiance, with a warning.

    Raises
    ------
    SceneError
        If the light is of another kind, varies, is negative, or too bright for single precision.
    """
    node = state.nodes[index]
    plugin, props = node.props.plugin_name(), node.props
    name, where = light_names(state, index, shape)
    if plugin in LIGHTS:
        quantity, unit = LIGHTS[plugin]
        if plugin == "spot" and "texture" in props:
            raise SceneError(
                message(
                    "a spot light with a texture is not rendered with matte",
                    where=where,
                    fix="leave out --matte (matte=True), or the texture",
                )
            )
        spectrum_name = f"{quantity} of light '{name}'"
        try:
            spectrum = plugin_spectrum(
                state, index, quantity, default=_DEFAULT, label=spectrum_name, emissive=True
            )
        except SpatialVariation:
            if not matte:
                raise
            spectrum = _average(state, index, shape, name)
    elif plugin in _AVERAGED and matte:
        spectrum, unit = _average(state, index, shape, name), LIGHTS["constant"][1]
    else:
        raise SceneError(
            message(
                f"light '{plugin}' is not supported",
                where=where,
                expected=f"one of {', '.join(LIGHTS)}" + ("" if matte else ", envmap, projector"),
                fix="make an environment map of it, or use --matte (matte=True) for a constant light of its average"
                if plugin in _AVERAGED
                else did_you_mean(plugin, LIGHTS) or "replace it",
            )
        )
    spectrum = without_noise(spectrum)
    check_light(name, spectrum.values, unit, SceneError)
    return Light(name, plugin, spectrum, unit, index)


def check_light(name: str, values: NDArray[np.float64], unit: str, error: type[FluorsparError]) -> None:
    """Raise this error if the spectrum of a light is negative, or too bright for single precision.

    Examples
    --------
    >>> check_light("lamp", np.array([0.5, -0.1]), "W m-2 sr-1 nm-1", SceneError)
    Traceback (most recent call last):
    ...
    fluorspar.errors.SceneError: light 'lamp' is negative
      got:      -0.1
      expected: 0 or more at all wavelengths
    """
    if (values < 0).any():
        fault, got, expected = "negative", values.min(), "0 or more at all wavelengths"
    elif (values >= LARGEST).any():
        fault, got, expected = "too bright for single precision", values.max(), f"below {LARGEST:g} {unit}"
    else:
        return
    raise error(message(f"light '{name}' is {fault}", got=float(got), expected=expected))


def _average(state: Any, index: int, shape: int | None, name: str) -> Spectrum:
    warnings.warn(
        f"light '{name}' is rendered with its average radiance everywhere",
        ApproximationWarning,
        stacklevel=3,
    )
    return average_light(state, index, shape, f"light '{name}'")
