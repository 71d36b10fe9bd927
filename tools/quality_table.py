"""Write the table of fit qualities into docs/materials.md, from the `quality` lines of the shipped materials.

    python tools/quality_table.py            # write it
    python tools/quality_table.py --check    # only say whether it is up to date

The lines are measured by tools/fit_materials.py, which has the matrices; this script needs the package only.
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fluorspar.bispectral.library import material, materials

PAGE = Path(__file__).parents[1] / "docs" / "materials.md"
BEGIN, END = "<!-- begin: tools/quality_table.py -->", "<!-- end: tools/quality_table.py -->"
LIGHTS = ("D65", "A", "FL11", "D65+UV", "D65-UV")
FINE, ALL = "D65, 5 nm", ("D65, all cells", "A, all cells", "FL11, all cells")


@dataclass(frozen=True)
class Quality:
    """What a `quality` line says of a fitted material."""

    name: str
    description: str
    rank: int
    differences: tuple[float, ...]
    noise: str
    unexplained: str
    photon_yield: str

    @property
    def cells(self) -> list[str]:
        numbers = [f"{value:.2f}" for value in self.differences]
        return [
            f"`{self.name}`",
            self.description,
            str(self.rank),
            *numbers,
            self.noise,
            self.unexplained,
            self.photon_yield,
        ]


def quality(name: str) -> Quality | None:
    """Read the line of a material; None if it was not fitted to a measured matrix."""
    made = material(name)
    text = made.quality
    if not (rank := re.match(r"rank (\d+); CIEDE2000", text)):
        return None
    differences = [float(_one(rf"[ ,:]{re.escape(light)} ([0-9.]+)[,;]", text)) for light in LIGHTS]
    differences.append(float(_one(r"D65 at 5 nm ([0-9.]+)", text)))
    all_cells = _one(r"above the diagonal ([^;]+);", text)
    differences += [float(_one(rf"{light} ([0-9.]+)", all_cells)) for light in ("D65", "A", "FL11")]
    return Quality(
        name,
        made.description,
        int(rank[1]),
        tuple(differences),
        _one(r"noise ([0-9.]+)", text),
        _one(r"unexplained (\d+ %)", text),
        _one(r"photon yield ([0-9.]+)", text),
    )


def _one(pattern: str, text: str) -> str:
    if not (found := re.search(pattern, text)):
        raise SystemExit(f"a quality line has no {pattern!r}: {text}")
    return found[1]


def table() -> str:
    """Return the table, a row for each fitted material and one of means."""
    rows = [row for name in materials() if (row := quality(name))]
    head = ["material", "what", "rank", *LIGHTS, FINE, *ALL, "noise per cell", "unexplained", "photon yield"]
    lines = ["| " + " | ".join(head) + " |", "|---|---|" + "---:|" * (len(head) - 2)]
    lines += ["| " + " | ".join(row.cells) + " |" for row in rows]
    means = [f"{value:.2f}" for value in np.mean([row.differences for row in rows], axis=0)]
    lines.append("| " + " | ".join(["**mean**", "", "", *means, "", "", ""]) + " |")
    dull = [name for name in materials() if material(name).quality.startswith("not fluorescent: no lum")]
    names = " and ".join(f"`{name}`" for name in dull)
    lines += ["", f"Measured and found not fluorescent, as they should be: {names}."]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if the table is old")
    check = parser.parse_args().check
    page = PAGE.read_text(encoding="utf-8")
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    new = f"{before}{BEGIN}\n{table()}\n{END}{after}"
    if check:
        if new != page:
            sys.exit(f"{PAGE}: the table is old; run python tools/quality_table.py")
        return
    PAGE.write_text(new, encoding="utf-8")


if __name__ == "__main__":
    main()
