"""A scene with other spectra: lights and materials exchanged by their ids, geometry and lobes as they are.

Light paths that were traced among the old ones serve the new ones.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from numbers import Real
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Material
from fluorspar.colour.xyz import luminance
from fluorspar.errors import FluorsparWarning, OptionError, message
from fluorspar.scene.lights import Light, check_light
from fluorspar.scene.lobes.lobe import STRAIGHT, Lobe, LobeRow, Lobes
from fluorspar.scene.lobes.rows import Coated, Luminescence, Metal, Operated, Reflection
from fluorspar.scene.recipe import check_library
from fluorspar.scene.scene import Scene
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.scene.surfaces import ABSORBS, NO_LIGHT, Surface
from fluorspar.spectral.illuminants import illuminant, listed_name
from fluorspar.spectral.light import sampled_or_averaged
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = [
    "LightSetting",
    "MaterialSetting",
    "exchangeable",
    "in_words",
    "light_ids",
    "lights_in_words",
    "relit",
]

LightSetting: TypeAlias = str | os.PathLike[str] | Spectrum | float | tuple[Any, float]
"""What a light may be given: a name or file, a spectrum, a factor, or one of the first two and a factor."""

MaterialSetting: TypeAlias = str | os.PathLike[str] | Material

_WHOLE = Wavelengths(300, 830, 1)  # nm, where lights are compared
_DARK = 1e-3  # lm/W: below this a lamp counts as invisible
_LM_PER_W = 683.0


def relit(
    scene: Scene,
    *,
    lights: Mapping[str, LightSetting] | None = None,
    materials: Mapping[str, MaterialSetting] | None = None,
    concentration: Mapping[str, float] | None = None,
    same_luminance: bool = False,
    library: Sequence[str | Path] = (),
) -> Scene:
    """Copy a scene with other lights and materials; see `LightPaths.image`.

    Raises
    ------
    OptionError
        If there is no such light, shape or BSDF; or if its material cannot be exchanged, or not for this one.
    MaterialError, SpectrumError
        If a material or light is unknown or impossible.

    Warns
    -----
    FluorsparWarning
        If a concentration changes nothing, because its material does not luminesce.

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> box = relit(load_scene("cornell-box"), lights={"light": 0.5}, materials={"left-wall": "poster-green"})
    >>> exchangeable(box)["left-wall"].name
    'poster-green'
    """
    for name, given in (("lights", lights), ("materials", materials), ("concentration", concentration)):
        if given is not None and not isinstance(given, Mapping):
            raise OptionError(
                message(f"the {name} are not readable", got=repr(given), expected="a dict, id: value")
            )
    check_library(library)
    table = list(scene.lights)
    rows = light_ids(scene)
    changed: dict[int, str] = {}
    for key, setting in (lights or {}).items():
        row = _known(key, rows, "light")
        if changed.setdefault(row, key) != key:
            raise OptionError(
                message(
                    "a light is changed twice",
                    where=scene.lights[row].name,
                    got=f"'{changed[row]}' and '{key}'",
                    expected="one id for each light",
                )
            )
        table[row] = _changed_light(scene.lights[row], key, setting, same_luminance)
    scene = replace(scene, lights=tuple(table))
    if not materials and not concentration:
        return scene
    given = {key: _material(key, value, library) for key, value in (materials or {}).items()}
    factors = {
        key: _factor(f"concentration of '{key}'", value) for key, value in (concentration or {}).items()
    }
    ids = dict.fromkeys(
        name for surface, _, ids in _parts(scene, scene.surfaces) for name in (surface.name, *ids)
    )
    for key in (*given, *factors):
        _check_material_id(scene, key, list(ids))
    made: dict[tuple[int, float], Material] = {}
    dull = {key for key, factor in factors.items() if factor != 1}

    def change(surface: Surface, old: Material, ids: Sequence[str]) -> Material:
        names = (surface.name, *ids)
        new = next((given[name] for name in names if name in given), old)
        key = next((name for name in names if name in factors), None)
        factor = 1.0 if key is None else factors[key]
        if key is not None and new.fluorescent:
            dull.discard(key)
        return made.setdefault((id(new), factor), new.with_concentration(factor))

    scene = _matte(scene, change) if scene.lobes is None else _general(scene, scene.lobes, change)
    for key in dull:
        text = f"the concentration of '{key}' changes nothing: its material does not luminesce"
        warnings.warn(text, FluorsparWarning, stacklevel=3)
    return scene


_Change: TypeAlias = Callable[[Surface, Material, Sequence[str]], Material]


def light_ids(scene: Scene) -> dict[str, int]:
    """Names by which lights can be changed, and their rows: their ids, and those of the shapes that they are on."""
    rows = {light.name: row for row, light in enumerate(scene.lights)}
    return {surface.name: surface.light for surface in scene.surfaces if surface.light != NO_LIGHT} | rows


def exchangeable(scene: Scene) -> dict[str, Material | str]:
    """What can be given another material: shapes and BSDFs by their ids, with their material, or why they cannot.

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> found = exchangeable(load_scene("cornell-box"))
    >>> found["left-wall"].name, found["light"].name
    ('poster-red', 'luminaire-78')
    """
    found: dict[str, Material | str] = {}
    for surface in scene.surfaces:
        reason = _why_not(scene, surface)
        found[surface.name] = reason or next(old for _, old, _ in _parts(scene, [surface]))
    for _, old, ids in _parts(scene, scene.surfaces):
        for name in ids:
            found.setdefault(name, old)
    return found


def _why_not(scene: Scene, surface: Surface) -> str:
    """Why the material of a surface cannot be exchanged by the id of the surface; "" if it can."""
    found = {id(old): ids for _, old, ids in _parts(scene, [surface])}
    if len(found) > 1:
        return f"it has several: name one of the BSDFs {_listed(found.values())}"
    if found:
        return ""
    lobes = (
        None
        if scene.lobes is None
        else [lobe for side in scene.lobes.of_surface[surface.node] for lobe in side]
    )
    if not lobes and surface.front == ABSORBS and surface.back == ABSORBS:
        return "it has no BSDF and absorbs all light"
    if any(lobe.texture >= 0 for lobe in lobes or ()):
        return "its colour is a texture"
    if any(lobe.angles for lobe in lobes or ()):
        return "its colour is that of a metal"
    return (
        "its colour is that of glass"
        if any(lobe.row for lobe in lobes or ())
        else "it has no colour of its own"
    )


def _parts(scene: Scene, surfaces: Iterable[Surface]) -> Iterator[tuple[Surface, Material, tuple[str, ...]]]:
    """Go through the materials of surfaces that can be exchanged, with the ids of their BSDFs."""
    for surface in surfaces:
        if scene.lobes is None:
            for row, ids in ((surface.front, surface.front_ids), (surface.back, surface.back_ids)):
                if row != ABSORBS:
                    yield surface, scene.materials[row], ids
        else:
            for side in scene.lobes.of_surface[surface.node]:
                for lobe in side:
                    if (base := _base(scene.lobes, lobe)) is not None:
                        yield surface, base, lobe.ids


def _base(lobes: Lobes, lobe: Lobe) -> Material | None:
    """The material that a lobe has its spectrum from, if it has it from one alone."""
    if lobe.gloss or lobe.texture >= 0 or lobe.angles:
        return None
    row = lobes.rows[lobe.row]
    return row if isinstance(row, Material) else getattr(row, "base", None)


def _matte(scene: Scene, change: _Change) -> Scene:
    """A scene of matte surfaces with other materials."""
    table = list(scene.materials)
    number = {id(old): row for row, old in enumerate(table)}

    def row(surface: Surface, before: int, ids: Sequence[str]) -> int:
        if before == ABSORBS:
            return ABSORBS
        new = change(surface, scene.materials[before], ids)
        if id(new) not in number:
            number[id(new)] = len(table)
            table.append(new)
        return number[id(new)]

    surfaces = [
        replace(
            surface,
            front=row(surface, surface.front, surface.front_ids),
            back=row(surface, surface.back, surface.back_ids),
        )
        for surface in scene.surfaces
    ]
    # What is on no surface any more goes: the excitation of its dyes is not to be computed.
    used = sorted({side for s in surfaces for side in (s.front, s.back)} - {ABSORBS}) or [0]
    new_row = {ABSORBS: ABSORBS} | {row: number for number, row in enumerate(used)}
    return replace(
        scene,
        materials=tuple(table[row] for row in used),
        surfaces=tuple(replace(s, front=new_row[s.front], back=new_row[s.back]) for s in surfaces),
    )


def _general(scene: Scene, lobes: Lobes, change: _Change) -> Scene:
    """A scene of general surfaces with other materials; the lobes are the same, of other spectra."""
    rows, first = list(lobes.rows), len(lobes.rows)
    number: dict[tuple[int, int], int] = {}

    def changed(surface: Surface, side: tuple[Lobe, ...], lobe: Lobe) -> Lobe:
        base = _base(lobes, lobe)
        if base is None:
            return lobe
        new = change(surface, base, lobe.ids)
        if new is base:
            return lobe
        row = lobes.rows[lobe.row]
        if new.fluorescent and not _takes_dyes(row, side):
            raise OptionError(
                message(
                    f"'{surface.name}' cannot get a fluorescent material: its glossy BSDF defines no luminescence",
                    got=new.name,
                    expected="a material without fluorescence",
                    fix="make its BSDF a 'fluorescent' one with int_ior, and trace again",
                )
            )
        if (lobe.row, id(new)) not in number:
            number[lobe.row, id(new)] = len(rows)
            rows.append(new if isinstance(row, Material) else replace(row, base=new))  # type: ignore[type-var]
        return replace(lobe, row=number[lobe.row, id(new)])

    of_surface = {
        surface.node: tuple(
            tuple(changed(surface, side, lobe) for lobe in side) for side in lobes.of_surface[surface.node]
        )
        for surface in scene.surfaces
    }
    more = len(rows) - first

    def behind(side: tuple[Lobe, ...]) -> tuple[Lobe, ...]:
        """Rows of texels come behind all others."""
        return tuple(
            replace(lobe, row=lobe.row + more) if lobe.texture >= 0 and lobe.row >= first else lobe
            for lobe in side
        )

    placed = {node: (behind(front), behind(back)) for node, (front, back) in of_surface.items()}
    new_lobes = replace(lobes, rows=tuple(rows), of_surface=placed)
    # What is on no surface any more goes: the excitation of its dyes is not to be computed.
    parts = {id(part): part for node in placed for kind, part in new_lobes.parts(node) if kind == "material"}
    seen = (isinstance(row, Metal) or id(getattr(row, "base", row)) in parts for row in rows)
    kept = tuple(row if is_seen else rows[0] for row, is_seen in zip(rows, seen, strict=True))
    number_of = {id(row): number for number, row in enumerate(parts.values())}

    def main(side: tuple[Lobe, ...]) -> int:
        main_rows = (number_of.get(id(kept[lobe.row])) for lobe in side if lobe.row < len(kept))
        return next((row for row in main_rows if row is not None), ABSORBS)

    return replace(
        scene,
        materials=tuple(parts.values()),
        surfaces=tuple(
            replace(s, front=main(placed[s.node][0]), back=main(placed[s.node][1])) for s in scene.surfaces
        ),
        lobes=replace(new_lobes, rows=kept),
    )


def _takes_dyes(row: LobeRow, side: tuple[Lobe, ...]) -> bool:
    """Whether what a lobe makes of a material is defined for luminescence."""
    if isinstance(row, Operated):
        return False
    if isinstance(row, (Coated, Luminescence, Reflection)):
        return True
    glossy = [lobe for lobe in side if lobe.gloss and lobe.channel != STRAIGHT]
    return not glossy and isinstance(row, Material)


def _check_material_id(scene: Scene, key: str, ids: Sequence[str]) -> None:
    """Refuse an id of no material that can be exchanged, and one of several."""
    surface = next((surface for surface in scene.surfaces if surface.name == key), None)
    if surface is not None and (reason := _why_not(scene, surface)):
        raise OptionError(
            message(
                f"the material of '{key}' cannot be exchanged: {reason}", expected=f"one of {', '.join(ids)}"
            )
        )
    if key not in ids:
        raise OptionError(
            message(
                f"there is no shape or BSDF '{key}' whose material can be exchanged",
                expected=f"one of {', '.join(ids) or '(none)'}",
                fix=did_you_mean(str(key), ids),
            )
        )


def _material(key: str, given: MaterialSetting, library: Sequence[str | Path]) -> Material:
    if isinstance(given, Material):
        return given
    if isinstance(given, str | os.PathLike):
        return material(given if isinstance(given, str) else Path(given), library)
    expected = "a Material, a name or mixture from the library, or a file"
    raise OptionError(message("this is not a material", where=key, got=repr(given), expected=expected))


def _factor(what: str, given: object) -> float:
    if isinstance(given, bool) or not isinstance(given, Real) or not 0 <= float(given) < np.inf:
        raise OptionError(
            message(f"the {what} is impossible", got=repr(given), expected="a number of 0 or more")
        )
    return float(given)


def _changed_light(light: Light, key: str, setting: LightSetting, same_luminance: bool) -> Light:
    """A light with another spectrum, or brightness."""
    given, factor = setting if isinstance(setting, tuple) and len(setting) == 2 else (setting, 1.0)
    factor = _factor(f"factor of light '{key}'", factor)
    old = light.spectrum
    if isinstance(given, Spectrum):
        new, relative = given, same_luminance
    elif isinstance(given, str | os.PathLike):
        new, relative = illuminant(str(given)), same_luminance or listed_name(str(given).strip()) is not None
    elif given is None:
        new, relative = old, False
    else:
        new, relative, factor = old, False, factor * _factor(f"factor of light '{key}'", given)
    if relative:
        factor *= _brightness(old, new, key)
    with np.errstate(over="ignore"):
        values = new.values * factor
    check_light(key, values, light.unit, OptionError)
    return replace(light, spectrum=replace(new, values=values, name=new.name or old.name))


def _brightness(old: Spectrum, new: Spectrum, key: str) -> float:
    """Factor that gives a lamp the luminance of another, or the power if one of them is hardly visible."""
    spectra = [sampled_or_averaged(spectrum, _WHOLE)[0] for spectrum in (old, new)]
    power = [float(values.sum()) for values in spectra]
    visible = [float(luminance(values, _WHOLE)) for values in spectra]
    by = visible if all(y > _DARK * _LM_PER_W * p for y, p in zip(visible, power, strict=True)) else power
    if by[1] <= 0:
        raise OptionError(
            message(f"the new light '{key}' is dark from {_WHOLE.start:g} to {_WHOLE.stop:g} nm")
        )
    return by[0] / by[1]


def _known(key: str, rows: Mapping[str, int], what: str) -> int:
    if key in rows:
        return rows[key]
    raise OptionError(
        message(
            f"there is no {what} '{key}'",
            expected=f"one of {', '.join(rows)}",
            fix=did_you_mean(str(key), rows),
        )
    )


def _listed(ids: Any) -> str:
    return ", ".join(dict.fromkeys(name for names in ids for name in names[-1:])) or "(they have no ids)"


def lights_in_words(
    scene: Scene,
    lights: Mapping[str, LightSetting] | None,
    same_luminance: bool,
    before: Mapping[str, str] | None = None,
) -> dict[str, str]:
    """What lights were changed to, for the attribute `lights` of an image: now, and before, each by one of its ids.

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> box = load_scene("cornell-box")
    >>> lights_in_words(box, {"light": 0.5}, False, {"shape 'light' (obj)": "A"})
    {"shape 'light' (obj)": 'A x 0.5'}
    """
    rows = light_ids(scene)
    said = dict(before or {})
    name_of = {rows[name]: name for name in said}
    for key, given in (lights or {}).items():
        key = name_of.get(rows[key], key)
        words = in_words(given)
        if isinstance(words, int | float) and key in said:
            said[key] = f"{said[key]} x {words}"
        else:
            said[key] = f"{words}{' (same luminance)' if same_luminance else ''}"
    return said


def in_words(given: Any) -> Any:
    """What a light, material or concentration was changed to, for the attributes of an image."""
    if isinstance(given, tuple):
        return " x ".join(str(in_words(part)) for part in given)
    if isinstance(given, int | float | str):
        return given
    if isinstance(given, np.generic):
        return given.item()
    return str(getattr(given, "name", given)) or "a spectrum"
