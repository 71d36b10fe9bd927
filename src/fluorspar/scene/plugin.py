"""The `fluorescent` BSDF: how a scene file says that a surface fluoresces."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Material
from fluorspar.errors import MaterialError, message
from fluorspar.scene.nodes import FLUORESCENT
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["COAT", "FLUORESCENT", "SPECTRA", "STRINGS", "register_plugins"]

SPECTRA = ("reflectance", "emission", "excitation")
STRINGS = ("donaldson", "material")
COAT = ("int_ior", "ext_ior", "alpha", "distribution")


def register_plugins() -> None:
    """Make the BSDF plugin `fluorescent` known to Mitsuba, for the variant that is set now.

    Needed once for each variant before stock Mitsuba tools load a scene with fluorescent surfaces;
    Fluorspar's own functions do without. To stock integrators the plugin is a diffuse surface with the
    reflectance S, under its coat if it has one: a preview without the luminescence.

    Raises
    ------
    RuntimeError
        From Mitsuba, if no variant is set.

    Notes
    -----
    Parameters of the plugin:

    reflectance : spectrum
        S, the reflected radiance factor.
    emission, excitation : spectrum
        alpha and beta; the scale of beta does not matter, it is normalised to integral 1 (1/nm).
    donaldson : string
        A full Donaldson matrix file, instead of the three spectra.
    material : string
        A material or mixture from the library (`"A:0.3,B:0.7"`), instead of the three spectra.
    concentration : float or texture
        Scales the luminescence; default 1. A picture makes a print of the dye.
    int_ior, ext_ior, alpha, distribution : float, float, float, string
        A clear coat, as that of `plastic`, or with a roughness as that of `roughplastic`; default: none.

    Examples
    --------
    >>> import mitsuba as mi
    >>> mi.set_variant("scalar_rgb")
    >>> register_plugins()
    >>> bsdf = mi.load_dict({"type": "fluorescent", "material": "poster-red"})
    """
    import mitsuba as mi

    mi.register_bsdf(FLUORESCENT, _make_class(mi))


def coat_plugin(coat: Mapping[str, Any]) -> str:
    """The plugin of Mitsuba whose coat a fluorescent surface has, by the properties of the coat."""
    return "roughplastic" if "alpha" in coat or "distribution" in coat else "plastic"


def _make_class(mi: Any) -> type:
    """Derive the plugin from the BSDF class of the variant that is set."""

    class Fluorescent(mi.BSDF):  # type: ignore[misc]
        """A diffuse BSDF, or one with a coat, that carries the spectra of a fluorescent material."""

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            named = [name for name in STRINGS if name in props]
            coat = {name: props[name] for name in COAT if name in props}
            self.concentration = props.get("concentration", 1.0)
            for name in (*SPECTRA, *STRINGS, *COAT):
                # Every accepted property has to be read, or the parser refuses the scene.
                if name in props:
                    props.mark_queried(name)
            if named:
                self.reflectance = _texture(mi, material(_resolved(mi, props[named[0]])).reflectance)
            else:
                self.reflectance = props.get_texture("reflectance", 0.5)
            self.shown = mi.load_dict(
                {
                    "type": coat_plugin(coat),
                    "diffuse_reflectance": self.reflectance,
                    "nonlinear": True,
                    **coat,
                }
                if coat
                else {"type": "diffuse", "reflectance": self.reflectance}
            )
            self.m_components = [self.shown.flags(part) for part in range(self.shown.component_count())]
            self.m_flags = self.shown.flags()

        def traverse(self, callback: Any) -> None:
            callback.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            return self.shown.sample(ctx, si, sample1, sample2, active)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.shown.eval(ctx, si, wo, active)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.shown.pdf(ctx, si, wo, active)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.shown.eval_pdf(ctx, si, wo, active)

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            return self.shown.eval_diffuse_reflectance(si, active)

        def to_string(self) -> str:
            return f"Fluorescent[reflectance={self.reflectance}, concentration={self.concentration}]"

    return Fluorescent


def _resolved(mi: Any, name: str) -> str:
    """Resolve a file name as Mitsuba does while it loads a scene; other names stay as they are."""
    path = Path(str(mi.file_resolver().resolve(name)))
    return str(path) if os.path.isfile(path) else name


def _texture(mi: Any, spectrum: Spectrum) -> Any:
    """Turn a table into a Mitsuba texture of the variant that is set."""
    finite = np.isfinite(spectrum.wavelengths)
    if not finite.all():
        return mi.load_dict({"type": "spectrum", "value": float(spectrum.values[0])})
    pairs = list(zip(spectrum.wavelengths.tolist(), spectrum.values.tolist(), strict=True))
    return mi.load_dict({"type": "spectrum", "value": pairs})


def check_properties(names: set[str], label: str) -> None:
    """Check that a fluorescent surface gives its material in exactly one way.

    Raises
    ------
    MaterialError
        If `material`, `donaldson` and spectra are mixed, or one of emission and excitation is missing.
    """
    given = sorted(names & {*SPECTRA, *STRINGS})
    strings = names & set(STRINGS)
    if strings and len(given) > 1:
        problem = f"properties {', '.join(given)} contradict each other"
    elif ("emission" in names) != ("excitation" in names):
        problem = "emission and excitation belong together"
    else:
        return
    raise MaterialError(
        message(
            problem,
            where=label,
            got=", ".join(given),
            expected="'material', or 'donaldson', or 'reflectance' with 'emission' and 'excitation'",
        )
    )


def material_of_spectra(
    name: str, reflectance: Spectrum, emission: Spectrum | None, excitation: Spectrum | None
) -> Material:
    """Make a material of the spectra a scene gives for a surface."""
    from fluorspar.bispectral.material import Fluorophore

    fluorophores = (
        () if emission is None or excitation is None else (Fluorophore(emission, excitation, name=name),)
    )
    return Material(name=name, reflectance=reflectance, fluorophores=fluorophores)
