"""`fluorspar view`: a window in the browser on images, light paths and scenes."""

from __future__ import annotations

from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.changes import LightOption, light_of, settings
from fluorspar.cli.given import pairs
from fluorspar.cli.options import LibraryOption
from fluorspar.cli.scene_options import SceneDefineOption, ViewpointOption
from fluorspar.errors import OptionError, message
from fluorspar.image.formats.registry import SUFFIXES
from fluorspar.scene.settings_text import size_of

__all__ = ["view"]

_EXAMPLES = """Lamps and dyes can be changed in light paths and scenes, not in images.

Examples:

  fluorspar view cornell-box --size 256x256 --spp 16

\b
  fluorspar view cornell-box --light light=A \\
      --camera "target=186,100,169 fov=20"

  fluorspar view measured.exr render.nc

  fluorspar view box.paths
"""


def view(
    what: Annotated[
        list[str],
        typer.Argument(
            help=f"Images ({', '.join(SUFFIXES)}), light paths (.paths), or scenes (.xml or built-in), "
            "which are traced first."
        ),
    ],
    host: Annotated[
        str, typer.Option(help="Address to listen on; any other than 127.0.0.1 lets other computers in.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen on; 0: any free one.")] = 0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address and open no browser.")
    ] = False,
    library: LibraryOption = None,
    spp: Annotated[
        int | None, typer.Option(help="Of scenes: samples per pixel. [default: the scene's]")
    ] = None,
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Of scenes: size in pixels. [default: the scene's]")
    ] = None,
    wavelengths: Annotated[
        str, typer.Option(metavar="START:STOP:STEP", help="Of scenes: wavelength grid in nm.")
    ] = "360:700:5",
    define: SceneDefineOption = None,
    camera: ViewpointOption = None,
    light: LightOption = None,
) -> None:
    """Look at images, light paths and scenes in the browser: components, spectra, other lamps and dyes."""
    import webbrowser

    from fluorspar.extras import check_extra

    check_extra("view")
    from fluorspar.view.opening import opened
    from fluorspar.view.security import LOOPBACK
    from fluorspar.view.server import Server
    from fluorspar.view.supplies import Supplies
    from fluorspar.view.workspace import Workspace

    supplies = Supplies(tuple(library or ()))
    sources = opened(
        what,
        supplies,
        pairs(define or [], "-D"),
        spp=spp,
        size=size_of(size),
        wavelengths=wavelengths,
        camera=camera,
        lights=settings(light, "--light", light_of),
    )
    of_scenes = {"--spp": spp, "--size": size, "-D": define, "--camera": camera, "--light": light}
    given = [name for name, value in of_scenes.items() if value]
    if given and all(source.kind != "scene" for source in sources):
        fault, fix = "an option of scenes is given, and no scene", "leave it out, or name a scene"
        raise OptionError(message(fault, where=", ".join(given), got=", ".join(what), fix=fix))
    with Server(Workspace(sources, supplies), host=host, port=port) as server:
        console.out.print(server.address, markup=False, highlight=False)
        if host not in LOOPBACK:
            console.warning("whoever knows this address can look, and what is sent is not encrypted")
        console.note("Ctrl-C closes it")
        if not no_browser:
            webbrowser.open(server.address)
        try:
            server.wait()
        except KeyboardInterrupt:
            console.note("closed")


view.__doc__ = f"{view.__doc__}\n\n{_EXAMPLES}"
