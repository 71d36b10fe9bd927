"""Check that the pages of a built site load nothing from elsewhere: they have to work where there is no network."""

from __future__ import annotations

import re
import sys
from pathlib import Path

# A link that a reader may follow is no such thing; a script, a style, a font or a picture is.
PAGE = re.compile(
    r"<(?:script|img|iframe|source|video|object|embed)\b[^>]*?\b(?:src|data)=[\"']?(?:https?:)?//[^>]*"
    r"|<link\b(?![^>]*rel=[\"'](?:canonical|author|license))[^>]*?\bhref=[\"']?(?:https?:)?//[^>]*"
    r"|import\s[^;<]{0,80}from\s*[\"']https?://[^\"']*"
)
STYLE = re.compile(r"(?:@import|url\()\s*[\"']?(?:https?:)?//[^)\"';]*")


def main(site: Path) -> None:
    pages, styles = sorted(site.rglob("*.html")), sorted(site.rglob("*.css"))
    found = [
        f"{file.relative_to(site)}: {match[0][:160]}"
        for files, pattern in ((pages, PAGE), (styles, STYLE), (pages, STYLE))
        for file in files
        for match in pattern.finditer(file.read_text("utf-8"))
    ]
    if found or not pages:
        sys.exit("\n".join([f"{len(pages)} pages, of which some load what is elsewhere:", *found]))
    print(f"{site}: {len(pages)} pages, none of which loads anything from elsewhere")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
