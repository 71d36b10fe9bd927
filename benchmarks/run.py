"""Where Fluorspar stands against stock Mitsuba: ratios from one run, measured in pairs.

    python benchmarks/run.py                          # all tables, about half an hour on 2 cores
    python benchmarks/run.py stock bands              # some of them
    python benchmarks/run.py mesh --mesh bunny.ply    # with a mesh of yours; without, the one of cornell-mesh

Every time is the median of pairs that follow each other, so that a change in the machine's speed cancels.
Compilation is excluded by a warm-up of both sides. An idle machine is needed.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

import fluorspar
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.colour.difference import ciede2000
from fluorspar.comparing.whites import lab_of
from fluorspar.errors import FluorsparWarning
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import trace_chunks
from fluorspar.paths.render import render_chunks
from fluorspar.paths.sweeping.gpu import why_not_on_gpu
from fluorspar.scene.nodes import copy_nodes, kind, resolving
from fluorspar.scene.variants import LOBE_VARIANTS, TRACE_VARIANTS, use_variant
from rooms import KINDS, write_room

SCENE = "cornell-box"


def stock_scene(scene: fluorspar.Scene) -> Any:
    """Build the scene as stock Mitsuba would have it: `diffuse` of each reflectance's maximum, merging allowed."""
    import mitsuba as mi

    highest = {
        surface.node: scene.materials[surface.front].on(fluorspar.Wavelengths()).reflectance.max()
        for surface in scene.surfaces
    }
    state = copy_nodes(scene.nodes)
    for index, node in enumerate(state.nodes):
        if kind(node) == "Emitter":
            node.props["radiance"] = 1.0
        elif kind(node) == "Shape":
            for key in list(node.props.keys()):
                if node.props.type(key) == mi.Properties.Type.ResolvedReference:
                    bsdf = state.nodes[node.props[key].index()]
                    if kind(bsdf) == "BSDF":
                        for name in list(bsdf.props.keys()):
                            del bsdf.props[name]
                        bsdf.props.set_plugin_name("diffuse")
                        bsdf.props["reflectance"] = float(highest[index])
        elif kind(node) == "Film":
            node.props["width"], node.props["height"] = scene.settings.width, scene.settings.height
            node.props["pixel_format"] = "luminance"
    with resolving(*scene.folders):
        built = mi.parser.instantiate(mi.parser.ParserConfig(mi.variant()), state)
    return built[0] if isinstance(built, list) else built


def seconds(call: Callable[[int], object], seed: int) -> float:
    began = time.perf_counter()
    call(seed)
    return time.perf_counter() - began


def pairs(
    count: int, ours: Callable[[int], object], theirs: Callable[[int], object]
) -> tuple[float, float, float]:
    """Return the median of our time, of theirs, and of the ratio, over pairs run in turn; seed 0 is to warm up."""
    seconds(ours, 0), seconds(theirs, 0)
    times = [(seconds(ours, seed), seconds(theirs, seed)) for seed in range(1, count + 1)]
    return (
        statistics.median(a for a, _ in times),
        statistics.median(b for _, b in times),
        statistics.median(a / b for a, b in times),
    )


def trace_only(scene: fluorspar.Scene, seed: int) -> None:
    for _ in trace_chunks(RenderJob(scene, seed=seed, variant="llvm")):
        pass


def against_stock(
    size: int, spp: int, count: int, ours: Callable[[fluorspar.Scene, int], object], variant: str = "llvm"
) -> str:
    """Our render, or its tracing alone, against one single-band render of stock `path`."""
    scene = fluorspar.load_scene(SCENE).with_settings(width=size, height=size, spp=spp)
    few = scene.with_settings(spp=min(spp, 64))  # to warm up
    with use_variant(TRACE_VARIANTS[variant]):
        import mitsuba as mi

        stock = stock_scene(scene)
        ours_time, theirs, ratio = pairs(
            count,
            lambda seed: ours(scene if seed else few, seed),
            lambda seed: np.array(mi.render(stock, seed=seed, spp=spp if seed else few.settings.spp)),
        )
    return f"{ratio:.2f} x   ({ours_time:.2f} s against {theirs:.2f} s, {size} x {size}, {spp} samples, {count} pairs)"


def general(size: int, spp: int, count: int) -> str:
    """Rooms of general surfaces against one render of stock `path` in three colours."""
    found = []
    for room in KINDS:
        with tempfile.TemporaryDirectory() as folder, use_variant(LOBE_VARIANTS["llvm"]):
            import mitsuba as mi

            path = write_room(room, Path(folder), size, spp)
            scene, stock = fluorspar.load_scene(path), mi.load_file(str(path))
            _, _, ratio = pairs(
                count,
                lambda seed, scene=scene: render(scene, seed),  # type: ignore[misc]
                lambda seed, stock=stock: np.array(mi.render(stock, seed=seed)),  # type: ignore[misc]
            )
        found.append(f"{room} {ratio:.2f} x")
    return f"{', '.join(found)}   ({size} x {size}, {spp} samples, {count} pairs each)"


def render(scene: fluorspar.Scene, seed: int, variant: str = "llvm") -> fluorspar.SpectralImage:
    return fluorspar.render(scene, seed=seed, variant=variant)


def mesh_cost(size: int, spp: int, count: int, mesh: str | None) -> str:
    """`cornell-mesh` with its mesh, or one of the user's, against `cornell-box`."""
    settings = {"width": size, "height": size, "spp": spp}
    box = fluorspar.load_scene(SCENE).with_settings(**settings)
    other = fluorspar.load_scene("cornell-mesh", parameters={"mesh": mesh} if mesh else None)
    other = other.with_settings(**settings)
    ours, plain, ratio = pairs(count, lambda seed: render(other, seed), lambda seed: render(box, seed))
    what = f"{Path(mesh).name if mesh else 'its own mesh'}, {size} x {size}, {spp} samples, {count} pairs"
    return f"{ratio:.2f} x   ({ours:.2f} s against {plain:.2f} s, {what})"


def recorded(size: int, spp: int) -> str:
    """Memory of light paths that are kept."""
    paths = fluorspar.trace(SCENE, size=(size, size), spp=spp, variant="llvm")
    return f"{paths.nbytes / (size * size * spp):.0f} B a sample   ({size} x {size}, {spp} samples)"


def relight(count: int) -> str:
    """Another image of light paths that are kept, under another lamp, against a render of the scene."""
    found = []
    for size, spp in ((256, 16), (512, 64)):
        scene = fluorspar.load_scene(SCENE).with_settings(width=size, height=size, spp=spp)
        paths = fluorspar.trace(scene, variant="llvm")
        ours, whole, ratio = pairs(
            count,
            lambda seed, paths=paths: paths.image(lights={"light": 1 + seed / 100}),  # type: ignore[misc]
            lambda seed, scene=scene: render(scene, seed),  # type: ignore[misc]
        )
        found.append(f"{ratio:.2f} x ({ours:.2f} s against {whole:.2f} s, {size} x {size}, {spp} samples)")
    return f"{', '.join(found)}   ({count} pairs each)"


def against_few_bands(count: int) -> str:
    """97 bands against 9."""
    scene = fluorspar.load_scene(SCENE).with_settings(width=512, height=512, spp=64)
    many, few, ratio = pairs(
        count,
        lambda seed: fluorspar.render(scene, seed=seed, wavelengths="300:780:5", variant="llvm"),
        lambda seed: fluorspar.render(scene, seed=seed, wavelengths="300:780:60", variant="llvm"),
    )
    return f"{ratio:.2f} x   ({many:.2f} s against {few:.2f} s, {count} pairs)"


def with_dyes(rank: int | None) -> dict[str, fluorspar.Material]:
    """The two fluorescent walls with each dye cut into equal parts, or with a full matrix (None).

    The parts add up to the dye, so paths, light and photon yields are those of rank 1 and only the sums differ.
    """
    grid = fluorspar.Wavelengths()
    made = {}
    for wall, name in (("red", "poster-red"), ("green", "poster-green")):
        whole = fluorspar.material(name)
        if rank is None:
            made[wall] = fluorspar.Material.from_matrix(
                name, MeasuredMatrix(grid.values, grid.values, whole.on(grid, stokes="strict").band(), name)
            )
        else:
            (dye,) = whole.fluorophores
            part = replace(dye, emission=dye.emission.scaled(1 / rank))
            made[wall] = replace(whole, fluorophores=(part,) * rank)
    return made


def fluorophores(size: int, spp: int, count: int) -> str:
    """Two, three, four fluorophores and a full matrix on both walls, each against one fluorophore."""
    settings = {"width": size, "height": size, "spp": spp}

    def scene(rank: int | None) -> fluorspar.Scene:
        return fluorspar.load_scene(SCENE, materials=with_dyes(rank)).with_settings(**settings)

    one = scene(1)
    found = []
    for rank in (2, 3, 4, None):
        more = scene(rank)
        _, _, ratio = pairs(
            count,
            lambda seed, more=more: render(more, seed),  # type: ignore[misc]
            lambda seed: render(one, seed),
        )
        found.append(f"{'full matrix' if rank is None else rank} {ratio:.3f} x")
    return f"{', '.join(found)}   ({size} x {size}, {spp} samples, {count} pairs each)"


def denoised(size: int, samples: tuple[int, ...], reference: int) -> str:
    """A box of few samples, denoised, against one of many: time, and mean CIEDE2000 without the lamp."""
    scene = fluorspar.load_scene(SCENE).with_settings(width=size, height=size)
    converged = fluorspar.render(scene.with_settings(spp=reference), seed=0)
    return "; ".join(denoised_against(converged, scene.with_settings(spp=spp)) for spp in samples)


def denoised_against(converged: fluorspar.SpectralImage, scene: fluorspar.Scene) -> str:
    fluorspar.render(scene).denoised(scene=scene)
    times, parts = [], []
    for seed in range(1, 4):
        began = time.perf_counter()
        image = fluorspar.render(scene, seed=seed)
        rendered = time.perf_counter()
        clean = image.denoised(scene=scene)
        times.append(time.perf_counter() - began)
        parts.append(time.perf_counter() - rendered)
    xyz = [found.xyz().values - found.xyz("source").values for found in (image, clean, converged)]
    white = np.array([0.95047, 1, 1.08883]) * np.percentile(xyz[-1][..., 1], 99) / 0.8
    labs = [lab_of(np.maximum(values, 0), white) for values in xyz]
    noisy, left = (float(ciede2000(lab, labs[-1]).mean()) for lab in labs[:2])
    settings, many = scene.settings, converged.attrs["spp"]
    return (
        f"{settings.spp} samples: {min(times):.1f} s, of which {min(parts):.1f} s to denoise; CIEDE2000 {left:.2f}, "
        f"before {noisy:.2f}   ({settings.width} x {settings.height}, against {many} samples, best of 3)"
    )


def command(*arguments: str) -> list[str]:
    return [str(Path(sys.executable).parent / "fluorspar"), *arguments]


def memory() -> str:
    """Peak resident memory of a large render to NetCDF."""
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder, "box.nc"))
        subprocess.run(
            command("render", SCENE, "--size", "1024x1024", "--spp", "256", "--variant", "llvm", "-o", out),
            check=True,
            capture_output=True,
        )
    return f"{resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20:.2f} GiB"


def cold_start() -> str:
    """A small render from a cold shell, second run."""
    with tempfile.TemporaryDirectory() as folder:
        run = command(
            "render",
            SCENE,
            "--size",
            "64x64",
            "--spp",
            "16",
            "--variant",
            "llvm",
            "-o",
            str(Path(folder, "a.nc")),
        )
        times = []
        for _ in range(4):
            began = time.perf_counter()
            subprocess.run(run, check=True, capture_output=True)
            times.append(time.perf_counter() - began)
    return f"{statistics.median(times[1:]):.2f} s"


BALL = """<scene version="3.0.0">
  <sensor type="perspective"> <float name="fov" value="39"/>
    <transform name="to_world"> <lookat origin="0, 1, 5" target="0, 1, 0" up="0, 1, 0"/> </transform>
    <film type="hdrfilm"> <rfilter type="box"/> </film> </sensor>
  <bsdf type="fluorescent" id="red"> <string name="material" value="poster-red"/> </bsdf>
  <bsdf type="fluorescent" id="white"> <string name="material" value="white-85"/> </bsdf>
  <shape type="sphere" id="ball"> <point name="center" x="0" y="$height" z="0"/> <ref id="red"/> </shape>
  <shape type="rectangle" id="floor"> <ref id="white"/>
    <transform name="to_world"> <rotate x="1" angle="-90"/> <scale value="5"/> </transform> </shape>
  <shape type="rectangle" id="lamp"> <ref id="white"/> <emitter type="area"> <rgb name="radiance" value="1"/> </emitter>
    <transform name="to_world"> <rotate x="1" angle="90"/> <translate y="5"/> </transform> </shape>
</scene>"""


def many(count: int) -> str:
    """Small renders of a batch on one core: each of another scene, and all of one scene with another light."""
    found = []
    for what, key in (("another scene each", "D.height"), ("relit", "light.lamp")):
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "ball.xml").write_text(BALL)
            for number in (2, count):  # the first is to warm up
                study = {
                    "output": f"{folder}/{number}-{{number}}.nc",
                    "render": {"scene": f"{folder}/ball.xml", "size": "32x32", "spp": 16, "variant": "llvm"},
                    "product": {key: {"start": 1, "stop": 2, "number": number}},
                }
                if key != "D.height":
                    study["render"]["D.height"] = 1  # type: ignore[index]
                began = time.perf_counter()
                index = fluorspar.batch(study, threads=1)
                taken = (time.perf_counter() - began) / number
                assert (index["status"] == "done").all()
        found.append(f"{what} {taken:.3f} s")
    return f"{', '.join(found)}   ({count} renders of 32 x 32, 16 samples, to .nc)"


def measured(*arguments: str) -> tuple[float, float]:
    """Seconds and peak resident memory in GiB of one command, from a cold shell."""
    began = time.perf_counter()
    process = subprocess.Popen(command(*arguments), stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, arguments)
    return time.perf_counter() - began, usage.ru_maxrss / 2**20


def comparison(size: int) -> str:
    """Two images of all components compared pixel by pixel, as they are and with one as triangular bands."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        names = [str(Path(folder, f"{seed}.nc")) for seed in range(2)]
        for seed, name in enumerate(names):
            few = ("--spp", "2", "--seed", str(seed))  # the fewest that have standard errors
            measured("render", SCENE, "--size", f"{size}x{size}", *few, "-o", name)
        for label, options in (("plain", ()), ("--bandwidth-b 10", ("--bandwidth-b", "10"))):
            runs = [measured("compare", *names, *options) for _ in range(3)]
            seconds, memory = statistics.median(run[0] for run in runs), max(run[1] for run in runs)
            found.append(f"{label} {seconds:.1f} s, {memory:.2f} GiB")
    return "; ".join(found)


_PLAIN = """
import sys, time, fluorspar
options = dict(size=(512, 512), spp=int(sys.argv[1]), variant="llvm", threads=1)
fluorspar.render("cornell-box", **options | {"spp": 1, "size": (64, 64)})
print(flush=True)
input()
began = time.perf_counter()
fluorspar.render("cornell-box", **options)
print(time.perf_counter() - began)
"""


def plain_renders(count: int, spp: int) -> float:
    """Seconds until as many plain renders of one thread each have ended that run at once."""
    command = [sys.executable, "-c", _PLAIN, str(spp)]
    runs = [
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for _ in range(count)
    ]
    for run in runs:
        assert run.stdout is not None
        run.stdout.readline()
    return max([float(answer) for answer in _all_at_once(runs)])


def _all_at_once(runs: list[subprocess.Popen[str]]) -> list[str]:
    for run in runs:
        assert run.stdin is not None
        run.stdin.write("\n")
        run.stdin.flush()
    return [run.communicate()[0] for run in runs]


def workers(spp: int, count: int) -> str:
    """One and two workers of one thread against a plain render of one thread; and what two processors can do here."""
    from fluorspar.cluster.connect import connected

    scene = fluorspar.load_scene(SCENE).with_settings(width=512, height=512, spp=spp)
    few = scene.with_settings(width=64, height=64)
    with connected(workers=1) as one, connected(workers=2) as two:

        def render_on(client: Any, seed: int) -> float:
            return seconds(
                lambda seed: fluorspar.render(scene, seed=seed, client=client, variant="llvm"), seed
            )

        for client in (one, two):
            for seed in range(4):
                fluorspar.render(few, seed=seed, client=client, variant="llvm")
        times = [
            (render_on(one, seed), render_on(two, seed), plain_renders(1, spp), plain_renders(2, spp))
            for seed in range(1, count + 1)
        ]
    speedup = statistics.median(a / b for a, b, _, _ in times)
    overhead = statistics.median(a / c - 1 for a, _, c, _ in times)
    limit = statistics.median(2 * c / d for _, _, c, d in times)
    return (
        f"2 / 1: {speedup:.2f} x, where two plain renders at once are {limit:.2f} x one; "
        f"1 / plain: {100 * overhead:+.0f} %   (512 x 512, {spp} samples, {count} pairs, load {os.getloadavg()[0]:.1f})"
    )


def client_memory(size: int) -> str:
    """Peak resident memory of the client of a large render to NetCDF, and the most of one of its workers."""
    import psutil

    found = []
    for spp in (1, 4):
        peaks: dict[int, float] = {}
        with tempfile.TemporaryDirectory() as folder:
            out = str(Path(folder, "box.nc"))
            shape = ("--size", f"{size}x{size}", "--spp", str(spp))
            run = command("render", SCENE, *shape, "--variant", "llvm", "--workers", "2", "-o", out)
            client = psutil.Popen(run, stdout=subprocess.DEVNULL)
            while client.poll() is None:
                with suppress(psutil.Error, OSError):
                    for process in (client, *client.children()):
                        status = Path(f"/proc/{process.pid}/status").read_text()
                        peaks[process.pid] = int(status.split("VmHWM:")[1].split()[0]) / 2**20
                time.sleep(0.2)
        workers = max(peak for pid, peak in peaks.items() if pid != client.pid)
        found.append(f"{spp} samples {peaks[client.pid]:.2f} GiB, a worker {workers:.2f} GiB")
    return f"{'; '.join(found)}   ({size} x {size} x 69, 2 workers)"


def gpu_agreement(name: str, size: int, spp: int) -> str:
    """The same light paths, traced on the GPU, swept there and on the processor: largest deviations."""
    scene = fluorspar.load_scene(name).with_settings(width=size, height=size, spp=spp)
    job = RenderJob(scene, seed=1, variant="cuda", component_errors=True)
    there = render_chunks(trace_chunks(job), job).dataset
    with (
        mock.patch("fluorspar.paths.render.sweeps_on_gpu", return_value=False),
        mock.patch("fluorspar.paths.chunks.sweeps_on_gpu", return_value=False),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore", FluorsparWarning)
        here = render_chunks(trace_chunks(job), job).dataset
    found = []
    for variable in ("radiance", "standard_error", "component_standard_error"):
        a, b = there[variable].values, here[variable].values
        found.append(f"{variable} {np.abs(a - b).max() / np.abs(b).max():.1e}")
    return f"{name}: {', '.join(found)} of the largest value   ({size} x {size}, {spp} samples)"


def gpu_relight(size: int, spp: int, count: int) -> str:
    """Another image of light paths that are kept: the first one unpacks them, the others sweep what is on the GPU."""
    scene = fluorspar.load_scene(SCENE).with_settings(width=size, height=size, spp=spp)
    paths = fluorspar.trace(scene, variant="cuda")
    times = [
        seconds(lambda seed: paths.image(lights={"light": 1 + seed / 100}), seed) for seed in range(count)
    ]
    return f"{statistics.median(times[2:]):.3f} s, first {times[0]:.2f} s   ({size} x {size}, {spp} samples)"


def gpu_memory(name: str, size: int, spp: int) -> str:
    """Most memory of the GPU in use while an image is rendered, by whomever."""
    from numba import cuda

    most, done = 0, threading.Event()

    def watch() -> None:
        nonlocal most
        while not done.wait(0.005):
            free, total = cuda.current_context().get_memory_info()
            most = max(most, total - free)

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        scene = fluorspar.load_scene(name).with_settings(width=size, height=size, spp=spp)
        took = seconds(lambda seed: render(scene, seed, "cuda"), 1)
    finally:
        done.set()
        watcher.join()
    return f"{name}: {most / 2**30:.2f} GiB, {took:.1f} s with compiling   ({size} x {size}, {spp} samples)"


def gpu() -> str:
    """All that is to be known of a GPU; it needs one, and `pip install 'fluorspar[cuda]'`."""
    if fault := why_not_on_gpu():
        return fault
    lines = [
        gpu_agreement(SCENE, 128, 64),
        gpu_agreement("still-life", 128, 64),
        "whole render / stock 1 band: " + against_stock(512, 64, 7, partial(render, variant="cuda"), "cuda"),
        "relit: " + gpu_relight(512, 64, 12),
        *(gpu_memory(name, 1024, spp) for name in (SCENE, "still-life") for spp in (64, 256)),
    ]
    return "".join(f"\n    {line}" for line in lines)


TABLES: dict[str, tuple[str, Callable[[argparse.Namespace], str]]] = {
    "trace": ("trace alone / stock 1 band, 64 spp", lambda _: against_stock(512, 64, 5, trace_only)),
    "stock": (
        "7 components x 69 bands + error / stock 1 band, 64 spp",
        lambda _: against_stock(512, 64, 5, render),
    ),
    "stock-1024": ("the same at 1024 spp", lambda _: against_stock(512, 1024, 2, render)),
    "general": ("the same in general scenes / stock rgb, 64 spp", lambda _: general(256, 64, 5)),
    "bands": ("97 bands / 9 bands", lambda _: against_few_bands(5)),
    "fluorophores": ("2, 3, 4 fluorophores a surface / 1", lambda _: fluorophores(512, 64, 5)),
    "mesh": ("a mesh in the box / the box", lambda given: mesh_cost(512, 64, 5, given.mesh)),
    "relight": ("paths relit / the whole render", lambda _: relight(5)),
    "paths": ("memory of light paths that are kept", lambda _: recorded(256, 64)),
    "denoise": ("a box of 8 and 16 samples, denoised", lambda _: denoised(512, (8, 16), 2048)),
    "memory": ("peak memory, 1024 x 1024 x 69, 256 spp, to .nc", lambda _: memory()),
    "batch": ("each render of a batch, one core", lambda _: many(500)),
    "compare": ("compare two images, 1024 x 1024 x 69, 7 components", lambda _: comparison(1024)),
    "workers": ("workers of one thread each, through Dask", lambda _: workers(256, 3)),
    "client": ("memory of the client, 2048 x 2048 x 69, to .nc", lambda _: client_memory(2048)),
    "gpu": ("with --variant cuda, where there is a GPU", lambda _: gpu()),
    "cold": ("64 x 64, 16 spp from a cold shell", lambda _: cold_start()),
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "tables", nargs="*", metavar="TABLE", help=f"one of {', '.join(TABLES)}; default: all"
    )
    parser.add_argument("--mesh", metavar="FILE", help="mesh of the table 'mesh'")
    arguments = parser.parse_args()
    chosen = arguments.tables or list(TABLES)
    if unknown := set(chosen) - set(TABLES):
        parser.error(f"no such table: {', '.join(sorted(unknown))}")
    for name in chosen:
        label, measure = TABLES[name]
        print(f"{label:<55} {measure(arguments)}", flush=True)


if __name__ == "__main__":
    main()
