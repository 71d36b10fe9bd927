"""The figures and numbers of the paper, made again: Tominaga, Guarnera, Ohtera, "Spectral Image Rendering of
Fluorescent Objects Using a Conventional Renderer", IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980.

    python examples/paper.py [-o out/paper] [--quick | --tiny] [--only 9,17,times] [--bunny FILE] [--list]

Pictures, numbers and an index page, `index.html`, go into the output folder. A step that fails or is interrupted does
not stop the others, and what an earlier run made stays in the index. docs/paper.md says what each step reproduces.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
import time
import traceback
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "agg")

from paper_figures import bunny, cornell, findings, materials, methods  # noqa: F401  they register their steps
from paper_figures.index import write_index
from paper_figures.workshop import FULL, QUICK, STEPS, TINY, Workshop, in_order


def main(arguments: list[str] | None = None) -> int:
    """Make the steps that are asked for; 0 if all went well, 1 if one failed, 130 after Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("out/paper"))
    parser.add_argument("--only", help="steps, such as 9,17,times; see --list")
    parser.add_argument(
        "--bunny", metavar="FILE", help="mesh of the object, y up; default: a stand-in of ours"
    )
    parser.add_argument("--list", action="store_true", help="list the steps")
    size = parser.add_mutually_exclusive_group()
    size.add_argument(
        "--quick",
        dest="sizes",
        action="store_const",
        const=QUICK,
        default=FULL,
        help="small and noisy: all of it within 5 minutes on two idle cores",
    )
    size.add_argument(
        "--tiny", dest="sizes", action="store_const", const=TINY, help="only to see that it runs"
    )
    args = parser.parse_args(arguments)
    if args.list:
        sys.stdout.write("".join(f"{step.key:10} {step.title}\n" for step in in_order()))
        return 0
    keys = [step.key for step in in_order()] if args.only is None else args.only.replace(" ", "").split(",")
    if unknown := [key for key in keys if key not in STEPS]:
        parser.error(
            f"there is no step {', '.join(unknown)}; there are {', '.join(each.key for each in in_order())}"
        )
    logging.getLogger("fluorspar").setLevel(logging.WARNING)
    return make(keys, Workshop(args.sizes, args.output, args.bunny))


def processor() -> float:
    """Seconds of all cores so far, of other programs as well that this one has started."""
    return sum(os.times()[:4])


def make(keys: list[str], work: Workshop) -> int:
    """Make some steps, one after another."""
    failed = []
    began = time.perf_counter(), processor()
    for count, key in enumerate(keys, 1):
        step = STEPS[key]
        sys.stderr.write(f"[{count}/{len(keys)}] {key}: {step.title}\n")
        start = time.perf_counter(), processor()
        try:
            made = step.make(work)
        except KeyboardInterrupt:
            sys.stderr.write(f"interrupted; what is finished is in {work.folder}\n")
            write_index(work.folder)
            return 130
        except Exception:
            failed.append(key)
            traceback.print_exc()
            continue
        seconds, cpu = time.perf_counter() - start[0], processor() - start[1]
        sys.stderr.write("".join(f"    {name}: {value}\n" for name, value in made.numbers.items()))
        sys.stderr.write(f"    {seconds:.1f} s, {cpu:.1f} s of a processor\n")
        made.save(work.folder / f"step-{key}.json", seconds=seconds, cpu_seconds=cpu, sizes=vars(work.sizes))
        write_index(work.folder)
    seconds, cpu = time.perf_counter() - began[0], processor() - began[1]
    sys.stderr.write(f"{seconds:.0f} s, {cpu:.0f} s of a processor: {work.folder / 'index.html'}\n")
    if failed:
        sys.stderr.write(f"failed: {', '.join(failed)}\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
