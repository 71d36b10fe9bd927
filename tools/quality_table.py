"""Write the tables of fit qualities into docs/materials.md, from the `quality` lines of the shipped materials.

    python tools/quality_table.py            # write them
    python tools/quality_table.py --check    # only say whether they are up to date

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
FINE, ALL = "D65, 5 nm", ("D65", "A", "FL11")


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


def quality(name: str) -> Quality | None:
    """Read the line of a material; None if it was not fitted to a measured matrix."""
    made = material(name)
    text = made.quality
    if not (rank := re.match(r"rank (\d+); CIEDE2000", text)):
        return None
    differences = [float(_one(rf"[ ,:]{re.escape(light)} ([0-9.]+)[,;]", text)) for light in LIGHTS]
    differences.append(float(_one(r"D65 at 5 nm ([0-9.]+)", text)))
    all_cells = _one(r"above the diagonal ([^;]+);", text)
    differences += [float(_one(rf"{light} ([0-9.]+)", all_cells)) for light in ALL]
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


def tables() -> str:
    """Return the tables: what was fitted, and the differences without and with the cells above the diagonal."""
    rows = [row for name in materials() if (row := quality(name))]
    below = len(LIGHTS) + 1
    facts = [[row.description, str(row.rank), row.noise, row.unexplained, row.photon_yield] for row in rows]
    dull = [name for name in materials() if material(name).quality.startswith("not fluorescent: no lum")]
    names = " and ".join(f"`{name}`" for name in dull)
    return "\n\n".join(
        [
            _table(rows, ["what", "rank", "noise per cell", "unexplained", "photon yield"], facts),
            f"Measured and found not fluorescent, as they should be: {names}.",
            "CIEDE2000, counting the diagonal and the cells below it:",
            _differences(rows, [*LIGHTS, FINE], slice(below)),
            "CIEDE2000, counting all cells:",
            _differences(rows, [*ALL], slice(below, None)),
        ]
    )


def _differences(rows: list[Quality], head: list[str], part: slice) -> str:
    """Return a table of some of the differences, with their means."""
    values = np.array([row.differences[part] for row in rows])
    cells = [[f"{value:.2f}" for value in line] for line in (*values, values.mean(axis=0))]
    return _table(rows, head, cells)


def _table(rows: list[Quality], head: list[str], cells: list[list[str]]) -> str:
    """Return a table with a row for each material, and one more if there are cells for it: the mean."""
    titles = [*(f"`{row.name}`" for row in rows), "**mean**"]
    lines = [["material", *head], ["---", *("---" if name == "what" else "---:" for name in head)]]
    lines += [[title, *line] for title, line in zip(titles, cells, strict=False)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if the tables are old")
    check = parser.parse_args().check
    page = PAGE.read_text(encoding="utf-8")
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    new = f"{before}{BEGIN}\n{tables()}\n{END}{after}"
    if check:
        if new != page:
            sys.exit(f"{PAGE}: the tables are old; run python tools/quality_table.py")
        return
    PAGE.write_text(new, encoding="utf-8")


if __name__ == "__main__":
    main()
