"""Files that were uploaded: read once, kept in memory as what they hold."""

from __future__ import annotations

import re
import secrets
import tempfile
import threading
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fluorspar.bispectral.files.registry import read_material
from fluorspar.bispectral.material import Material
from fluorspar.errors import FluorsparError, OptionError, message
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.view.curves import curve_of

__all__ = ["PREFIX", "Upload", "Uploads"]

PREFIX = "upload:"
_MOST = 200
_OTHER = re.compile(r"[^\w.+ -]+")


@dataclass(frozen=True, eq=False)
class Upload:
    """A file that was uploaded.

    Attributes
    ----------
    id : str
        Not to be guessed.
    name : str
        Of the file, without its folder.
    content : Spectrum or Material
    """

    id: str
    name: str
    content: Spectrum | Material

    def facts(self) -> dict[str, Any]:
        """What it is, for the page: the spectrum of a light, the reflectance of a material."""
        spectrum = self.content.reflectance if isinstance(self.content, Material) else self.content
        facts = {"id": self.id, "name": self.name} | curve_of(spectrum)
        return (
            facts | {"fluorescent": self.content.fluorescent} if isinstance(self.content, Material) else facts
        )


class Uploads:
    """Uploaded spectra of lights and materials by their ids; of too many the oldest go."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, Upload] = OrderedDict()
        self._lock = threading.Lock()

    def add(self, name: str, kind: str, content: bytes) -> Upload:
        """Read a file.

        Parameters
        ----------
        name : str
            Its suffix says the format.
        kind : str
            "light" or "material".
        content : bytes

        Raises
        ------
        SpectrumError, MaterialError
            If it is none.
        OptionError
            If the kind is another one.

        Examples
        --------
        >>> lamp = Uploads().add("lamp.csv", "light", b"wavelength,value\\n400,1\\n700,2")
        >>> lamp.name, lamp.content.at(550)
        ('lamp.csv', 1.5)
        """
        if kind not in ("light", "material"):
            expected = "light or material"
            raise OptionError(message("there is no such kind of upload", got=repr(kind), expected=expected))
        name = _OTHER.sub("_", Path(name.replace("\\", "/")).name)[-100:].lstrip(". ") or "upload.csv"
        with tempfile.TemporaryDirectory() as folder:
            # what reads files reads them by name; nothing but this one is in the folder
            file = Path(folder, name)
            file.write_bytes(content)
            try:
                read = illuminant(str(file)) if kind == "light" else read_material(file)
            except FluorsparError as err:
                raise type(err)(str(err).replace(f"{file.parent}/", "")) from None
        return self._keep(Upload(f"{PREFIX}{secrets.token_urlsafe(9)}", name, read))

    def _keep(self, upload: Upload) -> Upload:
        with self._lock:
            self._kept[upload.id] = upload
            while len(self._kept) > _MOST:
                self._kept.popitem(last=False)
        return upload

    def get(self, key: str) -> Upload:
        """An upload by its id.

        Raises
        ------
        OptionError
            If there is none.
        """
        with self._lock:
            if key in self._kept:
                return self._kept[key]
        fix = "upload the file again: the server keeps uploads only while it runs"
        raise OptionError(message("there is no such upload", got=repr(key), fix=fix))

    def light(self, key: str) -> Spectrum:
        """An uploaded spectrum of a light."""
        content = self.get(key).content
        if isinstance(content, Spectrum):
            return content
        raise OptionError(message("this upload is a material, not a light", got=repr(self.get(key).name)))

    def material(self, key: str) -> Material:
        """An uploaded material."""
        content = self.get(key).content
        if isinstance(content, Material):
            return content
        raise OptionError(message("this upload is a light, not a material", got=repr(self.get(key).name)))
