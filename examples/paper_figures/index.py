"""The index page: every step with its pictures, caption, numbers, and what makes it."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path

from .workshop import Step, in_order

_PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>The paper, reproduced</title>
<style>body{{font:16px/1.45 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}}
img{{max-width:100%;height:auto}} td,th{{padding:.1rem .8rem .1rem 0;text-align:left;vertical-align:top}}
table{{font-size:.9rem}} code{{background:#f2f2f2;padding:.1rem .3rem}} pre{{font-size:.85rem}}
section{{border-top:1px solid #ccc;margin-top:2rem}}</style>
<h1>The paper, reproduced</h1>
<p>Pictures and numbers after Tominaga, Guarnera, Ohtera, "Spectral Image Rendering of Fluorescent Objects Using a
Conventional Renderer", IEEE TVCG 2026, <a href="https://doi.org/10.1109/TVCG.2026.3668980">doi
10.1109/TVCG.2026.3668980</a>: made by Fluorspar with spectra, points and meshes of its own, so they are the paper's
in kind. <code>docs/paper.md</code> says what is certain, and what was found about the method.</p>
{body}
</html>
"""


def write_index(folder: Path) -> Path:
    """Write `index.html` of all steps that this or an earlier run made."""
    sections = [_section(step, folder) for step in in_order()]
    path = folder / "index.html"
    path.write_text(_PAGE.format(body="\n".join(sections)), encoding="utf-8")
    return path


def _section(step: Step, folder: Path) -> str:
    name = f"Figure {step.key}" if step.key.isdigit() else "Number"
    head = f'<section id="{step.key}"><h2>{name}: {escape(step.title)}</h2>'
    record = folder / f"step-{step.key}.json"
    command = f"python examples/paper.py --only {step.key}"
    by = f"<p><code>{command}</code>, function <code>{step.made_by}</code>"
    if not record.exists():
        return f"{head}<p>{escape(step.caption)}</p>{by}: not made yet.</p></section>"
    made = json.loads(record.read_text(encoding="utf-8"))
    pictures = "".join(f'<p><img src="{name}" alt="{escape(step.title)}"></p>' for name in made["pictures"])
    rows = "".join(
        f"<tr><td>{escape(key)}</td><td>{escape(value)}</td></tr>" for key, value in made["numbers"].items()
    )
    text = f"<pre>{escape(made['text'])}</pre>" if made["text"] else ""
    time = f"{made['seconds']:.1f} s, {made['cpu_seconds']:.1f} s of a processor"
    return (
        f"{head}{pictures}<p>{escape(step.caption)}</p><table>{rows}</table>{text}"
        f"{by}; made in {time}, renders that it shares with others included if it was the first.</p></section>"
    )
