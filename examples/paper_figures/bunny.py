"""The box with a curved fluorescent object: the Stanford bunny if its file is given, else a watertight stand-in."""

from __future__ import annotations

import numpy as np

import fluorspar

from .cornell import COLOURS, pair
from .methods import differences, side_by_side
from .workshop import Made, Workshop, step

CLOSE = "origin=278,320,-350 target=278,150,280 fov=45"


@step("23", "A curved fluorescent object")
def figure_23(work: Workshop) -> Made:
    """The object from nearer by, orange and fluorescent on gray, and with its reflectance alone, at one exposure.
    Without `--bunny FILE` it is a smooth closed body of ours."""
    size = work.square(work.sizes.pixels)
    paths = fluorspar.trace(
        work.mesh_scene, size=size, spp=work.sizes.samples, wavelengths=work.sizes.bands, camera=CLOSE
    )
    image = work.finished(paths.image())
    plain = work.finished(paths.image(concentration={"object": 0.0}))
    shown = {"fluorescent object": (image, None), "reflectance alone": (plain, None)}
    picture, numbers = work.pictures("figure-23.png", shown)
    return Made([picture], numbers | {"camera": CLOSE})


@step("24", "Emitters of the object")
def figure_24(work: Workshop) -> Made:
    """The centres of the emitters of the object, seen from the front and from the rear, with what each gives out at
    600 nm; its size is that of the emitter's area."""
    import xarray as xr

    _ = work.staged_mesh
    figure, axes = work.panels("", 2, height=3.2)
    with xr.open_dataset(work.folder / "steps-cornell-mesh" / "L_F-object.nc", engine="h5netcdf") as kept:
        centre, area = kept["centre"].values, kept["area"].values
        emitted = kept["emission"].sel(wavelength=600, method="nearest").values
    middle = np.median(centre[:, 2])
    marker = 0.5 * area / area.mean() * 25000 / len(area)
    for panel, title, front in zip(axes[0], ("front", "rear"), (True, False), strict=True):
        side = (centre[:, 2] < middle) == front
        shown = panel.scatter(
            centre[side, 0],
            centre[side, 1],
            s=np.minimum(marker[side], 300),
            c=emitted[side],
            cmap="inferno",
            vmin=0,
            vmax=emitted.max(),
            edgecolor="0.3",
            linewidth=0.4,
        )
        panel.set(xlabel="x, mm", ylabel="y (upwards), mm", aspect="equal")
        panel.set_title(f"{title}: {side.sum()} of {len(area)} emitters", fontsize=9)
        panel.set_xlim(centre[:, 0].min() - 30, centre[:, 0].max() + 30)
        panel.set_ylim(0, centre[:, 1].max() + 30)
        if front:
            panel.invert_xaxis()  # the camera looks along z, where x runs to the left
    figure.colorbar(shown, ax=axes, label="emission at 600 nm, W m⁻² sr⁻¹ nm⁻¹")
    return Made([work.save(figure, "figure-24.png")])


@step("25", "What the emitters of the object give out")
def figure_25(work: Workshop) -> Made:
    """Emission spectra of the emitters of the object: each, and their mean over the area."""
    import xarray as xr

    _ = work.staged_mesh
    figure, axes = work.panels("", 1, height=2.8, width=4.8)
    with xr.open_dataset(work.folder / "steps-cornell-mesh" / "L_F-object.nc", engine="h5netcdf") as kept:
        area, emitted, nm = kept["area"].values, kept["emission"].values, kept["wavelength"].values
    axes[0][0].plot(nm, emitted.T, color="0.75", linewidth=0.5)
    axes[0][0].plot(nm, area @ emitted / area.sum(), color=COLOURS[1], label="mean over the area")
    axes[0][0].set(xlabel="wavelength, nm", ylabel="L_F, W m⁻² sr⁻¹ nm⁻¹", xlim=(400, 700), ylim=(0, None))
    axes[0][0].legend(fontsize=8)
    return Made([work.save(figure, "figure-25.png")], {"emitters": str(len(area))})


@step("26", "The object: components 2, 4 and 5")
def figure_26(work: Workshop) -> Made:
    """Luminescence excited by direct light, by indirect light, and what luminesced elsewhere before, at one
    exposure."""
    return pair(
        work, 26, work.mesh, ["direct_luminescence", "indirect_luminescence", "luminescent_reflection"]
    )


@step("27", "The object: reflected and luminescent light")
def figure_27(work: Workshop) -> Made:
    """Components 1 + 3, 2 + 4 + 5, and all light, at the exposure of all light."""
    exposure = work.mesh.srgb().exposure
    shown = {
        "reflected, 1 + 3": (work.mesh, "reflected"),
        "luminescent, 2 + 4 + 5": (work.mesh, "luminescent"),
        "all light": (work.mesh, None),
    }
    picture, numbers = work.pictures("figure-27.png", shown, exposure)
    return Made([picture], numbers)


@step("28", "The object by independent methods")
def figure_28(work: Workshop) -> Made:
    """As Figure 18, for the scene with the object."""
    return side_by_side(work, 28, "cornell-mesh")


@step("29", "The object by independent methods: differences")
def figure_29(work: Workshop) -> Made:
    """As Figure 19, for the scene with the object: signed differences of the displayed R, G, B around grey."""
    return differences(work, 29, "cornell-mesh")
