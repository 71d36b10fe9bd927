"""What a mesh of many triangles costs the one-pass method: `cornell-mesh` with it against `cornell-box`.

python benchmarks/mesh_cost.py [MESH] [--size 512] [--spp 64] [--pairs 3]
"""

from __future__ import annotations

import argparse
import statistics
import time

import fluorspar
from fluorspar.scene.loading import load_scene
from fluorspar.scene.scene import Scene


def seconds(scene: Scene, seed: int) -> float:
    """Time of one render."""
    began = time.perf_counter()
    fluorspar.render(scene, seed=seed)
    return time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", nargs="?")
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--pairs", type=int, default=3)
    args = parser.parse_args()
    settings = {"width": args.size, "height": args.size, "spp": args.spp}
    box = load_scene("cornell-box").with_settings(**settings)
    mesh = load_scene("cornell-mesh", parameters={"mesh": args.mesh} if args.mesh else None)
    mesh = mesh.with_settings(**settings)
    for scene in (box, mesh):  # compiles
        seconds(scene, 0)
    ratios = []
    for pair in range(args.pairs):
        plain, other = seconds(box, pair), seconds(mesh, pair)
        ratios.append(other / plain)
        print(f"box {plain:.2f} s, mesh {other:.2f} s, ratio {other / plain:.2f}", flush=True)
    print(f"median ratio {statistics.median(ratios):.2f}")


if __name__ == "__main__":
    main()
