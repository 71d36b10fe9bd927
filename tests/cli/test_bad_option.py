"""What an option that is misspelt or out of range gets."""

from __future__ import annotations

import pytest
from command_line import GOOD, CommandLine, ball

GRID = "expected: START:STOP:STEP in nm"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--size", "8by8"), ("the size is not readable", "where: --size", "got: 8by8", "WIDTHxHEIGHT")),
        (("--size", "8"), ("the size is not readable", "where: --size", "got: 8", "WIDTHxHEIGHT")),
        (("--size", "0x8"), ("width is out of range", "got: 0", "expected: 1 to")),
        (("--wavelengths", "400-700"), ("wavelength grid is not readable", "got: '400-700'", GRID)),
        (("--wavelengths", "700:400:10"), ("must ascend from start to stop", "got: 700:400:10", GRID)),
        (("--wavelengths", "400:700:0"), ("must ascend from start to stop", "got: 400:700:0", GRID)),
        (("--wavelengths", "400:705:10"), ("not a whole number of steps", "got: 400:705:10", GRID)),
        (("--spp", "0"), ("spp is out of range", "got: 0", "expected: 1 to")),
        (("--seed", "-1"), ("the seed is negative", "got: -1", "expected: 0 to")),
        (("--seed", 2**63), ("the seed is too large", f"got: {2**63}", f"expected: 0 to {2**63 - 1}")),
        (("--max-depth", "0"), ("max_depth is out of range", "got: 0", "1 or more, or -1 for unlimited")),
        (("--rr-depth", "0"), ("rr_depth is out of range", "got: 0", "expected: 1 to")),
        (("--threads", "0"), ("number of threads is out of range", "got: 0", "expected: 1 or more")),
        (("--method", "magic"), ("there is no such method", "got: 'magic'", "expected: one of paths")),
        (("--variant", "opencl"), ("there is no such variant", "got: 'opencl'", "one of llvm, cuda")),
        (("--stokes", "quarter"), ("no such Stokes rule", "got:", "quarter", "expected:", "half", "strict")),
        (
            ("--until", "1%"),
            ("target of the render is not readable", "got: '1%'", "expected: error=FRACTION"),
        ),
        (("--until", "error=0"), ("target of the render is not readable", "got: 'error=0'", "above 0")),
        (
            ("--until", "p95=2%", "--max-time", "soon"),
            ("longest time", "got: 'soon'", "expected: a time above 0"),
        ),
        (("--max-time", "10m"), ("time is given without a target", "got: 10m", "fix:", "--until error=1%")),
        (
            ("--until", "error=1%", "--method", "staged"),
            ("staged method cannot render until", "fix:", "--spp"),
        ),
        (("--material", "ball"), ("not readable", "where: --material", "got: ball", "expected: KEY=VALUE")),
        (("--material", "=gray-45"), ("not readable", "where: --material", "got: =gray-45", "KEY=VALUE")),
        (("-D", "radius"), ("not readable", "where: -D", "got: radius", "expected: KEY=VALUE")),
        (("-D", "radius=2"), ("where: scene.xml", "unused parameters", "radius=2")),
    ],
    ids=str,
)
def test_refused(fluorspar: CommandLine, options: tuple[object, ...], message: tuple[str, ...]) -> None:
    assert fluorspar.refuses(GOOD, *options).says(*message)


def test_value_that_the_scene_leaves_open(fluorspar: CommandLine) -> None:
    said = fluorspar.refuses(ball('<bsdf type="diffuse" id="$paint"/>'))
    assert said.says("where: scene.xml", "undefined parameter: $paint")


def test_values_that_are_right(fluorspar: CommandLine) -> None:
    done = fluorspar.render(
        ball('<bsdf type="diffuse" id="$paint"/>'), "-D", "paint=wall", "--material", "wall=gray-45",
        "--seed", 2**63 - 1, "--stokes", "strict", "--threads", 1, "--component-errors",
    )  # fmt: skip
    assert (done.code, done.err) == (0, "")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--spp", "many"), "error: invalid value for '--spp'"),
        (("--sp", "4"), "error: no such option: --sp"),
        (("other.xml",), "error: got unexpected extra argument"),
    ],
)
def test_usage(fluorspar: CommandLine, arguments: tuple[str, ...], message: str) -> None:
    """The messages of the parser look as all others, name the option and point to the help."""
    before = fluorspar.files()
    done = fluorspar("render", "scene.xml", "-o", "old.nc", *arguments)
    assert done.code == 2
    assert done.says(message, "fix: see", "render --help")
    assert fluorspar.files() == before


def test_no_output(fluorspar: CommandLine) -> None:
    done = fluorspar("render", "cornell-box")
    assert done.code == 2
    assert done.says("error: missing option", "--output")


def test_unknown_command(fluorspar: CommandLine) -> None:
    done = fluorspar("rendr", "cornell-box")
    assert done.code == 2
    assert done.says("error: no such command 'rendr'")


def test_graphics_card_that_is_not_there(fluorspar: CommandLine) -> None:
    import mitsuba as mi

    before = mi.variant()
    try:
        mi.set_variant("cuda_ad_mono")
    except ImportError:
        pass
    else:
        if before:
            mi.set_variant(before)
        pytest.skip("this machine has one")
    said = fluorspar.refuses(GOOD, "--variant", "cuda")
    assert said.says("'cuda_ad_mono' does not start", "got:", "expected: one of", "fix: use variant 'llvm'")
