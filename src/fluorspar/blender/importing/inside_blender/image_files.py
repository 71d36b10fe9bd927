"""The images of a file, copied or converted into a folder."""

from __future__ import annotations

import shutil
from array import array
from pathlib import Path
from typing import Any

from .values import Said

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy

__all__ = ["Images"]

KEPT_FORMATS = {
    "PNG": ".png",
    "JPEG": ".jpg",
    "OPEN_EXR": ".exr",
    "HDR": ".hdr",
    "BMP": ".bmp",
}


class Images:
    """The images of a file, copied into a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.table: list[Said] = []
        self.numbers: dict[str, int] = {}

    def number(self, image: Any) -> int:
        if image.name_full not in self.numbers:
            self.numbers[image.name_full] = len(self.table)
            self.table.append(self.copied(image, len(self.table)))
        return self.numbers[image.name_full]

    def copied(self, image: Any, number: int) -> Said:
        said = {
            "name": image.name,
            "space": image.colorspace_settings.name,
            "source": image.source,
            "alpha": image.alpha_mode,
            "file": None,
        }
        if image.source not in ("FILE", "GENERATED"):
            return said
        path = bpy.path.abspath(image.filepath, library=image.library)
        if not image.size[0]:  # this reads it
            return {**said, "missing": path}
        stem = "".join(c if c.isalnum() or c in "-_" else "-" for c in Path(image.name).stem)[:60]
        known = KEPT_FORMATS.get(image.file_format)
        self.folder.mkdir(exist_ok=True)
        if image.source == "FILE" and known:
            file = self.folder / f"{number}-{stem}{known}"
            if image.packed_file is not None:
                file.write_bytes(image.packed_file.data)
            else:
                shutil.copyfile(path, file)
        else:
            file = self.folder / f"{number}-{stem}{'.exr' if image.is_float else '.png'}"
            self.converted(image).save(filepath=str(file))
        return {**said, "file": file.name}

    def converted(self, image: Any) -> Any:
        """The same pixels as another image: one that is packed would be saved as the file that it was."""
        kind = {"alpha": image.channels == 4, "float_buffer": image.is_float}
        made = bpy.data.images.new("converted", *image.size, **kind)
        made.colorspace_settings.name, made.alpha_mode = image.colorspace_settings.name, image.alpha_mode
        values = array("f", bytes(4 * len(image.pixels)))
        image.pixels.foreach_get(values)
        if image.channels < 4:
            grown = array("f", [1.0]) * (4 * (len(values) // image.channels))
            for channel in range(3):
                grown[channel::4] = values[min(channel, image.channels - 1) :: image.channels]
            values = grown
        made.pixels.foreach_set(values)
        made.file_format = "OPEN_EXR" if image.is_float else "PNG"
        return made
