"""Check what `python -m build` has made: nothing is missing, and the wheel works where there is nothing else."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
NOT_DISTRIBUTED = {".ci/run", ".gitignore"}
COMMANDS = [
    "--version",
    "doctor",
    "materials list",
    "materials show poster-red --plot red.png",
    "scenes",
    "render cornell-box --size 16x16 --spp 2 -o box.nc -o box.exr -o box.png",
    "render still-life --size 16x12 --spp 2 -o still-life.nc",
    "info box.nc",
    "measure box.nc points.csv -o spectra.csv",
]


def missing(wheel: Path, sdist: Path) -> list[str]:
    """The files of the repository that a wheel, or a source distribution, lacks."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    tracked = set(listed.split("\n")) - {""}
    with zipfile.ZipFile(wheel) as archive:
        packed = {f"src/{name}" for name in archive.namelist()}
    with tarfile.open(sdist) as archive:
        whole = {name.partition("/")[2] for name in archive.getnames()}
    code = {name for name in tracked if name.startswith("src/")}
    return [
        *(f"{wheel.name} lacks {name}" for name in sorted(code - packed)),
        *(f"{sdist.name} lacks {name}" for name in sorted(tracked - NOT_DISTRIBUTED - whole)),
    ]


def use(wheel: Path, constraints: Path, interpreter: str) -> None:
    """Install the wheel into a new environment, in a folder far from the repository, and run it there."""
    subprocess.run([interpreter, "--version"], check=True)
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([interpreter, "-m", "venv", str(Path(folder, "venv"))], check=True)
        python = str(Path(folder, "venv", "bin", "python"))
        pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, "--constraint", str(constraints.resolve()), str(wheel.resolve())], check=True)
        Path(folder, "points.csv").write_bytes((ROOT / "examples" / "cornell-points.csv").read_bytes())
        for command in COMMANDS:
            print(f"fluorspar {command}")
            run = [python, "-I", "-m", "fluorspar", *command.split()]
            done = subprocess.run(
                run, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
            )
            if done.returncode:
                sys.exit(f"{done.stdout}\nexit code {done.returncode}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where a wheel and a source distribution are")
    parser.add_argument("--constraint", type=Path, required=True, help="the versions to install beside it")
    parser.add_argument("--python", default=sys.executable, help="the Python of that environment")
    given = parser.parse_args()
    (wheel,), (sdist,) = given.folder.glob("*.whl"), given.folder.glob("*.tar.gz")
    faults = missing(wheel, sdist)
    if faults:
        sys.exit("\n".join(faults))
    use(wheel, given.constraint, given.python)


if __name__ == "__main__":
    main()
