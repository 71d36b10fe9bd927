"""What a view changes of a scene, in the forms that `LightPaths.image` takes."""

from __future__ import annotations

from typing import Any

from fluorspar.scene.relit import light_ids, relit
from fluorspar.scene.scene import Scene
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.view.questions import LightSetting, Relight
from fluorspar.view.supplies import Supplies

__all__ = ["changes_of", "light_of", "relit_scene"]


def light_of(scene: Scene, name: str, setting: LightSetting | None, supplies: Supplies) -> Spectrum:
    """The spectrum that a light has in a view, in its unit.

    A spectrum of a menu or drawn by hand is as bright as the scene's, to the eye; one that was uploaded is as it is.

    Raises
    ------
    OptionError
        If the scene has no such light.
    SpectrumError
        If the spectrum is impossible.
    """
    setting = setting or LightSetting()
    asked = setting.spectrum
    given = None if asked is None else supplies.lamp(asked)
    as_bright = asked is not None and asked.upload is None
    changed = relit(scene, lights={name: (given, setting.factor)}, same_luminance=as_bright)
    return changed.lights[light_ids(changed)[name]].spectrum


def changes_of(scene: Scene, relight: Relight, supplies: Supplies) -> dict[str, Any]:
    """Arguments of `LightPaths.image` for what a view changes."""
    return {
        "lights": {
            name: light_of(scene, name, setting, supplies) for name, setting in relight.lights.items()
        },
        "materials": {name: supplies.material(value) for name, value in relight.materials.items()},
        "concentration": dict(relight.concentration),
    }


def relit_scene(scene: Scene, relight: Relight, supplies: Supplies) -> Scene:
    """The scene of a view."""
    return relit(scene, **changes_of(scene, relight, supplies))
