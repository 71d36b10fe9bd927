"""The Cornell box with two fluorescent walls: its components, and its points."""

from __future__ import annotations

import fluorspar
from fluorspar.measuring.points import read_points

from .workshop import NUMBERED, POINTS, Made, Workshop, step

BANDWIDTH = 8.0  # nm, FWHM: that of a spectroradiometer
ON_RED = "1"  # a point on the red wall
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")


def pair(work: Workshop, number: int, image: fluorspar.SpectralImage, names: list[str]) -> Made:
    """Pictures of components at one exposure, that of their sum, and their shares of all light but the lamp."""
    exposure = image.srgb(names).exposure
    picture, numbers = work.pictures(
        f"figure-{number}.png", {NUMBERED[name]: (image, name) for name in names}, exposure
    )
    return Made([picture], numbers | shares(image, names))


def shares(image: fluorspar.SpectralImage, names: list[str]) -> dict[str, str]:
    lit = [name for name in image.components if name != "source"]
    luminance = {name: float(image.luminance(name).mean()) for name in lit}
    whole = sum(luminance.values())
    return {f"{NUMBERED[name]}, share of mean luminance": f"{luminance[name] / whole:.2%}" for name in names}


@step("1", "The box with and without fluorescence")
def figure_1(work: Workshop) -> Made:
    """The Cornell box under CIE D65 with two fluorescent walls, and the same walls with their reflectance alone: at
    one exposure, from the same light paths."""
    plain = work.box_paths.image(concentration=dict.fromkeys(("left-wall", "right-wall"), 0.0))
    shown = {"fluorescent walls": (work.box, None), "reflectance alone": (work.finished(plain), None)}
    picture, numbers = work.pictures("figure-1.png", shown)
    gain = float(work.box.luminance().mean() / plain.luminance().mean()) - 1
    return Made([picture], numbers | {"mean luminance, gain by fluorescence": f"{gain:+.1%}"})


@step("4", "The light on a fluorescent wall, by its kind")
def figure_4(work: Workshop) -> Made:
    """Illumination E (irradiance over pi) at point 1 on the red wall: direct from the lamp, reflected by other
    surfaces, and luminescent, from fluorescent surfaces. Each is component 1, 3 or 5 over the reflectance of the wall;
    the band is its standard error. The aperture is 2 degrees, to lower the noise."""
    names = ("direct_reflection", "indirect_reflection", "luminescent_reflection")
    figure, axes = work.panels("", 1, height=2.8, width=4.8)
    point = [each for each in read_points(POINTS) if each.name == ON_RED]
    for name, label, colour in zip(names, ("direct", "indirect", "luminescent"), COLOURS, strict=False):
        spectra = fluorspar.measure(work.box, point, scene="cornell-box", aperture="2deg", component=name)
        s = fluorspar.material("poster-red").reflectance.on(spectra.grid)
        light = spectra.radiance[0] / s
        axes[0][0].plot(spectra.grid.values, light, color=colour, label=label)
        if spectra.standard_error is not None:
            error = spectra.standard_error[0] / s
            axes[0][0].fill_between(
                spectra.grid.values, light - error, light + error, color=colour, alpha=0.3, linewidth=0
            )
    axes[0][0].set(xlabel="wavelength, nm", ylabel="E, W m⁻² sr⁻¹ nm⁻¹", ylim=(0, None))
    axes[0][0].legend(fontsize=8)
    return Made([work.save(figure, "figure-4.png")])


@step("9", "Components 1 and 3: reflected light")
def figure_9(work: Workshop) -> Made:
    """Direct and indirect light, reflected and not luminesced, at one exposure."""
    return pair(work, 9, work.box, ["direct_reflection", "indirect_reflection"])


@step("10", "Components 2 and 4: luminescence")
def figure_10(work: Workshop) -> Made:
    """Luminescence of the walls excited by direct and by indirect light, at one exposure."""
    return pair(work, 10, work.box, ["direct_luminescence", "indirect_luminescence"])


@step("11", "Component 5: luminescence on other surfaces")
def figure_11(work: Workshop) -> Made:
    """Light that luminesced once on a wall and was reflected by other surfaces; beside it what the paper leaves out,
    light that luminesced twice or more, at the same exposure."""
    return pair(work, 11, work.box, ["luminescent_reflection", "reexcitation"])


@step("12", "All reflected and all luminescent light")
def figure_12(work: Workshop) -> Made:
    """Components 1 + 3, which never luminesced, and 2 + 4 + 5, which did once, at the exposure of the whole image."""
    exposure = work.box.srgb().exposure
    shown = {"reflected, 1 + 3": (work.box, "reflected"), "luminescent, 2 + 4 + 5": (work.box, "luminescent")}
    picture, numbers = work.pictures("figure-12.png", shown, exposure)
    share = float(work.box.luminance("luminescent").mean() / work.box.luminance().mean())
    return Made([picture], numbers | {"luminescent share of mean luminance": f"{share:.1%}"})


@step("13", "The whole image")
def figure_13(work: Workshop) -> Made:
    """The sum of components 0 to 5, the paper's Eq. 13 with the lamp, and the sum of all seven, at one exposure."""
    shown = {"0 to 5 (Eq. 13)": (work.box, "single_bounce"), "all light": (work.box, None)}
    picture, numbers = work.pictures("figure-13.png", shown)
    left_out = 1 - float(work.box.luminance("single_bounce").mean() / work.box.luminance().mean())
    return Made([picture], numbers | {"luminance that Eq. 13 leaves out": f"{left_out:.2%}"})


@step("17", "Numbered measuring points")
def figure_17(work: Workshop) -> Made:
    """13 numbered points of ours on the box, in daylight of 5500 K (CIE D55). The paper's are on a box of its own,
    and their coordinates are in its figure only."""
    from fluorspar.measuring.visible import visible_pixels

    image = work.finished(work.box_paths.image(lights={"light": "D55"}))
    points = read_points(POINTS)
    width, height = image.size
    scene = fluorspar.load_scene("cornell-box").with_settings(width=width, height=height)
    pixels = visible_pixels(scene, points)

    def mark(panel: object) -> None:
        for point, (x, y) in zip(points, pixels - 0.5, strict=True):
            panel.plot(x, y, "o", color="white", markeredgecolor="black", markersize=4)
            panel.annotate(
                point.name,
                (x, y),
                (5, 4),
                textcoords="offset points",
                fontsize=9,
                bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.7},
            )

    picture, numbers = work.pictures("figure-17.png", {"cornell-box under D55": (image, None)}, overlay=mark)
    return Made([picture], numbers)


@step("20", "Spectra of the points, reflected and luminescent")
def figure_20(work: Workshop) -> Made:
    """Radiance at the 13 points, through triangular bands of 8 nm: all light, and of it what luminesced. The band is
    the standard error."""
    light = {
        "all light": (None, "#000000"),
        "reflected": ("reflected", COLOURS[0]),
        "luminescent": ("luminescent", COLOURS[1]),
    }
    figure, axes = work.panels("", 5, 3, height=1.6, width=9)
    for name, (component, colour) in light.items():
        spectra = fluorspar.measure(
            work.box, POINTS, aperture="1deg", bandwidth=BANDWIDTH, component=component
        )
        for panel, radiance, number in zip(axes.flat, spectra.radiance, spectra.names, strict=False):
            panel.plot(spectra.grid.values, radiance, color=colour, label=name, linewidth=1)
            panel.set_title(f"point {number}", fontsize=8)
            panel.tick_params(labelsize=7)
        if component is None and spectra.standard_error is not None:
            for panel, mean, error in zip(axes.flat, spectra.radiance, spectra.standard_error, strict=False):
                panel.fill_between(spectra.grid.values, mean - error, mean + error, color="0.7", linewidth=0)
    for panel in axes.flat[13:]:
        panel.set_axis_off()
    for panel in axes.flat[:13]:
        panel.set_ylim(0, None)
    axes[2][3].legend(*axes[0][0].get_legend_handles_labels(), loc="center", fontsize=8)
    figure.supxlabel("wavelength, nm", fontsize=8)
    figure.supylabel("radiance, W m⁻² sr⁻¹ nm⁻¹", fontsize=8)
    return Made([work.save(figure, "figure-20.png")])
