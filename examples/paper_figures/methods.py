"""The paper's procedure beside the one-pass method, on Mitsuba and, where Blender is found, on Cycles."""

from __future__ import annotations

import os
import shutil
from typing import Any

import numpy as np

import fluorspar
from fluorspar.staged.timings import timing_table

from .cornell import COLOURS
from .workshop import POINTS, Made, Workshop, step

MATCH = "7"  # the top of the short block


def has_blender() -> bool:
    return bool(os.environ.get("BLENDER") or shutil.which("blender"))


def by_method(work: Workshop, what: str) -> dict[str, fluorspar.SpectralImage]:
    """The same scene, size and bands by each method."""
    scene: Any = "cornell-box" if what == "cornell-box" else work.mesh_scene
    images = {
        "one pass": work.reference_box if what == "cornell-box" else work.reference_mesh,
        "staged on Mitsuba": work.staged_box if what == "cornell-box" else work.staged_mesh,
    }
    if has_blender():
        images["staged on Cycles"] = work.on_cycles(scene, what)
    return images


def side_by_side(work: Workshop, number: int, what: str) -> Made:
    images = by_method(work, what)
    shown = {name: (image, "single_bounce") for name, image in images.items()}
    picture, numbers = work.pictures(f"figure-{number}.png", shown)
    first = images["one pass"]
    for name, image in list(images.items())[1:]:
        for part in (*[each for each in image.components if each != "source"], "single_bounce"):
            pixels = [
                each.component(part)
                if part != "single_bounce"
                else each.total(single_bounce=True) - each.component("source")
                for each in (first, image)
            ]
            mean = [float(each.mean()) for each in pixels]
            label = "components 1 to 5" if part == "single_bounce" else part
            numbers[f"{name}, {label}"] = f"{mean[1] / mean[0] - 1:+.2%}"
    return Made([picture], numbers)


def differences(work: Workshop, number: int, what: str) -> Made:
    images = by_method(work, what)
    first = images.pop("one pass")
    figure, axes = work.panels("", 2 * len(images), height=9 / (2 * len(images)) + 0.6, width=9)
    numbers = {}
    for (name, image), (signed, colour) in zip(images.items(), axes.reshape(-1, 2), strict=True):
        compared = fluorspar.compare(first, image, component="single_bounce")
        assert compared.images is not None
        signed.imshow(np.clip(0.5 + 4 * compared.images.rgb_difference, 0, 1), interpolation="nearest")
        signed.set_title(f"{name}:\ngrey + 4 (B − A)", fontsize=8)
        shown = colour.imshow(compared.images.de00, vmin=0, vmax=10, cmap="magma", interpolation="nearest")
        colour.set_title("CIEDE2000", fontsize=8)
        figure.colorbar(shown, ax=colour, shrink=0.7, extend="max")
        for panel in (signed, colour):
            panel.set_axis_off()
        numbers[f"{name}, mean CIEDE2000"] = f"{np.nanmean(compared.images.de00):.2f}"
        if compared.images.noise is not None:
            numbers[f"{name}, difference"] = (
                "more than noise" if compared.images.noise.differs else "no more than noise"
            )
    return Made([work.save(figure, f"figure-{number}.png")], numbers)


@step("18", "The box by independent methods")
def figure_18(work: Workshop) -> Made:
    """Components 0 to 5 of the box by the one-pass method and by the paper's procedure, on Mitsuba and, if Blender is
    there, on Cycles, at one exposure. The numbers are differences of means over all pixels and bands from the one-pass
    method."""
    return side_by_side(work, 18, "cornell-box")


@step("19", "The box by independent methods: differences")
def figure_19(work: Workshop) -> Made:
    """Signed differences of the displayed R, G, B from the one-pass method (A), four times enlarged around grey, and
    maps of CIEDE2000. Noise of single pixels is most of it."""
    return differences(work, 19, "cornell-box")


@step("21", "Spectra of the points by two methods")
def figure_21(work: Workshop) -> Made:
    """Eq. 14: spectra at the 13 points by the one-pass method (A) and the paper's procedure (B), each divided by its
    own mean at point 7, the top of the short block; RMSE with one root over all points, from 400 to 700 nm, and
    CIEDE2000. The aperture is a disk of 5 degrees of ours, as wide as some pixels, because the images are small."""
    compared = fluorspar.compare(
        work.reference_box,
        work.staged_box,
        points=POINTS,
        match=MATCH,
        aperture="2.5deg",
        component="single_bounce",
    )
    points = compared.points
    assert points is not None
    figure, axes = work.panels("", 5, 3, height=1.6, width=9)
    at = points.names.index(MATCH)
    sides = ((points.a, "one pass", COLOURS[0], "-"), (points.b, "staged", COLOURS[1], "--"))
    nm = compared.grid.values
    inside = (nm >= 400) & (nm <= 700)
    for values, label, colour, dash in sides:
        unit = values[at, inside].mean()
        for panel, spectrum in zip(axes.flat, values, strict=False):
            panel.plot(nm, spectrum / unit, dash, color=colour, label=label, linewidth=1)
    for panel, name, rmse, de00 in zip(axes.flat, points.names, points.rmse, points.de00, strict=False):
        panel.set_title(f"{name}: RMSE {rmse:.3f}, ΔE {de00:.1f}", fontsize=7)
        panel.tick_params(labelsize=7)
        panel.set_ylim(0, None)
    for panel in axes.flat[13:]:
        panel.set_axis_off()
    axes[2][3].legend(*axes[0][0].get_legend_handles_labels(), loc="center", fontsize=8)
    figure.supxlabel("wavelength, nm", fontsize=8)
    figure.supylabel("radiance over that of point 7", fontsize=8)
    numbers = {
        "RMSE, Eq. 14": f"{points.rmse_eq14:.4f}",
        "mean RMSE of the points": f"{points.rmse.mean():.4f}",
        "CIEDE2000, mean and greatest": f"{points.de00.mean():.2f}, {points.de00.max():.2f}",
    }
    if points.noise is not None:
        numbers["verdict"] = "more than noise" if points.noise.differs else "no more than noise"
    return Made([work.save(figure, "figure-21.png")], numbers)


@step("22", "Emitters of the walls")
def figure_22(work: Workshop) -> Made:
    """What each of the 8 x 8 emitters of the red and the green wall gives out near 640 and 540 nm: the emission that
    stands for the wall in component 5, constant over each emitter."""
    import xarray as xr

    _ = work.staged_box
    figure, axes = work.panels("", 2, height=3.1)
    for panel, wall, nm in zip(axes[0], ("left-wall", "right-wall"), (640, 540), strict=True):
        with xr.open_dataset(work.folder / "steps-cornell-box" / f"L_F-{wall}.nc", engine="h5netcdf") as kept:
            centre = kept["centre"].values
            emitted = kept["emission"].sel(wavelength=nm, method="nearest")
            shown = panel.scatter(centre[:, 2], centre[:, 1], c=emitted, s=170, marker="s", cmap="viridis")
            figure.colorbar(shown, ax=panel, shrink=0.75, label="W m⁻² sr⁻¹ nm⁻¹")
            panel.set(xlabel="z (to the back), mm", ylabel="y (upwards), mm", aspect="equal")
            panel.set_title(f"{wall}, {float(emitted['wavelength']):g} nm", fontsize=9)
    return Made([work.save(figure, "figure-22.png")])


@step("times", "Time of the passes")
def times(work: Workshop) -> Made:
    """Time of each pass of the paper's procedure relative to component 1, for the box and for the scene with the
    object, as in the paper's table. The front and the rear of the object are one row here."""
    tables = [
        f"{what}, {image.size[0]} x {image.size[1]} pixels, {image.attrs['spp']} samples, "
        f"{len(image.wavelengths)} bands\n" + timing_table(image.attrs["timings"])
        for what, image in (("cornell-box", work.staged_box), ("cornell-mesh", work.staged_mesh))
    ]
    return Made(text="\n\n".join(tables))
