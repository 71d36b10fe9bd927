"""Feed damaged scenes, tables, images and light paths to the command line, and see that it answers as it promises.

    python tools/fuzz.py                           # two minutes, as long for each kind
    python tools/fuzz.py --seconds 600 --seed 7 --most 1000
    python tools/fuzz.py --only number:31          # one case again, with what it printed

Every command must end with exit code 0 or 2, print no traceback and no control character, die of no signal, take no
longer than three minutes, and write finite pixels only. A case is a kind and a number: the same number makes the same
files. Cases run inside worker processes, many in each; one that dies or hangs is replaced by another, so what a case
depends on is mended first if it cannot be repeated alone.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from fuzz_cases import GRID, KINDS, SCENES

SLOWEST = 180  # seconds a case may take; the first one may compile
MOST = 100  # cases of a kind, so that a faster machine tries the same ones
MEMORY = 12 * 2**30  # bytes a worker may ask for
ANSWERS = (0, 2)


def run_case(name: str, seed: int, base: Path) -> dict[str, Any]:
    """Make a case, run it in an empty folder, and say what is wrong."""
    kind, _, number = name.partition(":")
    case = KINDS[kind](int(number), Random(f"{seed} {name}"), base)
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    faults, printed = [], ""
    try:
        os.chdir(folder)
        for file, data in case.files.items():
            Path(file).write_bytes(data)
        for command in case.commands:
            code, text = run_command(command)
            printed += f"$ fluorspar {' '.join(command)}\n{text}(exit code {code})\n"
            if code not in ANSWERS:
                last = [line for line in text.splitlines() if line.strip()][-2:-1]
                faults.append(f"{command[0]} ends with exit code {code}: {' '.join(last)[:150]}")
            elif "Traceback" in text:
                faults.append(f"{command[0]} prints a traceback")
            if re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", text):
                faults.append(f"{command[0]} prints a control character")
            if code == 0 and case.checked and os.path.exists(case.checked) and not finite(case.checked):
                faults.append(f"{command[0]} writes pixels that are not finite")
    finally:
        os.chdir("/")
        shutil.rmtree(folder, ignore_errors=True)
    return {"what": case.what, "faults": faults, "printed": printed}


def run_command(arguments: list[str]) -> tuple[int, str]:
    """Run the command line within this process; return its exit code and all that it printed."""
    from fluorspar.cli.main import main

    sys.argv = ["fluorspar", *arguments]
    code: object = 0
    with tempfile.TemporaryFile() as kept:
        outputs = os.dup(1), os.dup(2)
        os.dup2(kept.fileno(), 1), os.dup2(kept.fileno(), 2)
        try:
            main()
        except SystemExit as leaving:
            code = leaving.code or 0
        finally:
            sys.stdout.flush(), sys.stderr.flush()
            for descriptor, output in enumerate(outputs, start=1):
                os.dup2(output, descriptor)
                os.close(output)
        kept.seek(0)
        return int(str(code)), kept.read().decode(errors="replace")


def finite(path: str) -> bool:
    import h5py
    import numpy as np

    with h5py.File(path) as file:
        return all(np.isfinite(file[name][...]).all() for name in ("radiance", "standard_error"))


def work(seed: int, base: Path) -> None:
    """A worker: names of cases come in, one a line, results go out."""
    with suppress(ImportError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    for line in sys.stdin:
        answers.write(json.dumps(run_case(line.strip(), seed, base)) + "\n")


def prepare(base: Path) -> None:
    """Render the image that is damaged later, in all formats, and trace its paths."""
    os.chdir(base)
    (base / "base.xml").write_text(SCENES[0])
    outputs = [part for suffix in ("nc", "exr", "hdr") for part in ("-o", f"base.{suffix}")]
    code, text = run_command(["render", "base.xml", "--wavelengths", GRID, *outputs])
    assert code == 0, text
    code, text = run_command(["trace", "base.xml", "--wavelengths", GRID, "-o", "base.paths"])
    assert code == 0, text


@dataclass
class Worker:
    """A process that runs cases, started anew when it dies."""

    arguments: list[str]
    process: subprocess.Popen[str] | None = field(default=None)

    def run(self, name: str) -> dict[str, Any]:
        if self.process is None:
            self.process = subprocess.Popen(
                [sys.executable, __file__, *self.arguments, "--worker"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            )  # fmt: skip
        process, late = self.process, threading.Event()
        assert process.stdin is not None
        assert process.stdout is not None
        timer = threading.Timer(SLOWEST, lambda: (late.set(), process.kill()))
        timer.start()
        process.stdin.write(f"{name}\n")
        process.stdin.flush()
        answer = process.stdout.readline()
        timer.cancel()
        if answer:
            return dict(json.loads(answer))
        code = process.wait()
        self.process = None
        fault = f"takes more than {SLOWEST} s" if late.is_set() else f"the process ended with {code}"
        return {"what": "", "faults": [fault], "printed": ""}

    def close(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait()


class Cases:
    """The names of the cases to run, those of the kind next that has had the least time; and what came of them."""

    def __init__(self, only: list[str], kinds: list[str], most: int) -> None:
        self.most = most
        self.only = list(reversed(only))
        self.repeated = bool(only)
        self.spent = dict.fromkeys([] if only else kinds, 0.0)
        self.taken, self.counts, self.failed = Counter[str](), Counter[str](), Counter[str]()
        self.lock = threading.Lock()

    def next(self) -> str | None:
        with self.lock:
            if self.repeated:
                return self.only.pop() if self.only else None
            left = [kind for kind in self.spent if self.taken[kind] < self.most]
            if not left:
                return None
            kind = min(left, key=self.spent.__getitem__)
            self.spent[kind] += 0.1  # until it is known how long it takes
            self.taken[kind] += 1
            return f"{kind}:{self.taken[kind] - 1}"

    def done(self, name: str, seed: int, took: float, result: dict[str, Any]) -> None:
        kind = name.partition(":")[0]
        with self.lock:
            self.counts[kind] += 1
            if self.repeated:
                print(result["printed"])
            else:
                self.spent[kind] += took
            if result["faults"]:
                self.failed[kind] += 1
                what = f" ({result['what']})" if result["what"] else ""
                print(f"--seed {seed} --only {name}{what}: {'; '.join(result['faults'])}", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=120)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--most", type=int, default=MOST, help="cases of each kind")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="KIND:NUMBER", help="these cases, with their output"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--base", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--prepare", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.prepare:
        prepare(given.base)
        return 0
    if given.worker:
        work(given.seed, given.base)
        return 0
    base = Path(tempfile.mkdtemp(prefix="fuzz-base-"))
    cases = Cases(given.only, given.kinds, given.most)
    end = time.monotonic() + given.seconds

    def run_cases() -> None:
        worker = Worker(["--seed", str(given.seed), "--base", str(base)])
        while time.monotonic() < end and (name := cases.next()) is not None:
            began = time.monotonic()
            result = worker.run(name)
            cases.done(name, given.seed, time.monotonic() - began, result)
        worker.close()

    try:
        subprocess.run([sys.executable, __file__, "--base", str(base), "--prepare"], check=True)
        threads = [threading.Thread(target=run_cases) for _ in range(1 if given.only else given.workers)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        shutil.rmtree(base, ignore_errors=True)
    print(", ".join(f"{kind}: {cases.failed[kind]} of {cases.counts[kind]} failed" for kind in cases.counts))
    idle = [kind for kind in cases.spent if not cases.counts[kind]]
    if idle:
        print(f"no case was tried of {', '.join(idle)}: give it more --seconds")
    return 1 if cases.failed.total() or idle else 0


if __name__ == "__main__":
    sys.exit(main())
