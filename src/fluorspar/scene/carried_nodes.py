"""Mitsuba's nodes of a scene as plain values, with the contents of its files: for machines that share no folder."""

from __future__ import annotations

import hashlib
import pickle
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fluorspar.errors import SceneError, message
from fluorspar.files.temporary import temporary_folder
from fluorspar.scene.kept_nodes import KeptNodes, reads_file
from fluorspar.scene.nodes import copy_nodes, label, resolved, resolving
from fluorspar.scene.variants import SPECTRUM_VARIANT, use_variant

__all__ = ["CarriedNodes"]


class _Node(NamedTuple):
    plugin: str
    id: str
    kind: int
    file_index: int
    offset: int
    properties: dict[str, tuple[str, Any]]  # name of the type, and a value that pickles


class CarriedNodes(KeptNodes):
    """The nodes of a scene that pickle with all that is read again of its files: meshes and pictures.

    Where they arrive no scene file is parsed. The files lie in a temporary folder of the process from when the nodes
    are first needed until they go.

    Parameters
    ----------
    kept : KeptNodes

    Raises
    ------
    SceneError
        If a file is gone, or is not the one that was loaded; or if a scene dict holds a value that does not pickle.
    """

    def __init__(self, kept: KeptNodes, scene: str) -> None:
        state = copy_nodes(kept.state())  # Mitsuba finds misspelt properties by who reads them
        digests = dict(kept.fingerprint.files)
        self.fingerprint, self.folders = kept.fingerprint, ()
        self._state = self._made = None
        self._nodes = [_plain(state.nodes[index], index) for index in range(len(state.nodes))]
        self._files: dict[str, bytes] = {}
        self._file_of: dict[int, tuple[str, str]] = {}
        with use_variant(SPECTRUM_VARIANT), resolving(*kept.folders):
            paths = {
                i: resolved(node.props["filename"]) for i, node in enumerate(state.nodes) if reads_file(node)
            }
        for index, path in paths.items():
            digest = digests.get(str(path), "")
            self._file_of[index] = digest, path.name
            if digest not in self._files:
                self._files[digest] = _content(path, digest, scene)

    def _parse_again(self) -> Any:
        """Make the nodes of what was carried here."""
        import mitsuba as mi

        folder = Path(tempfile.mkdtemp(dir=temporary_folder()))
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        for digest, content in self._files.items():
            (folder / digest).mkdir()
            for name in {name for of, name in self._file_of.values() if of == digest}:
                (folder / digest / name).write_bytes(content)
        state = mi.parser.ParserState()
        with use_variant(SPECTRUM_VARIANT):
            for index, node in enumerate(self._nodes):
                made = _made(node)
                if index in self._file_of:
                    made.props["filename"] = str(folder.joinpath(*self._file_of[index]))
                state.nodes.append(made)
        return state


def _content(path: Path, digest: str, scene: str) -> bytes:
    """Read a file that was there when the scene was loaded."""
    try:
        content = path.read_bytes()
    except OSError:
        content = None
    if content is None or hashlib.sha256(content).hexdigest() != digest:
        raise SceneError(
            message(
                "the scene has changed since it was loaded",
                where=scene,
                got=f"{path} {'is gone' if content is None else 'has changed'}",
                expected="the same files, which are sent to workers",
                fix="load the scene again",
            )
        )
    return content


def _plain(node: Any, index: int) -> _Node:
    props = node.props
    properties = {}
    for key in props.keys():  # noqa: SIM118 (not a dict)
        of, value = str(props.type(key)).rpartition(".")[2], props[key]
        if of in ("Vector", "Color"):
            value = [float(part) for part in value]
        elif of == "Transform":  # its inverse would not be the same to the last bit
            value = np.array(value.matrix).tolist(), np.array(value.inverse_transpose).tolist()
        elif of == "Spectrum":
            value = list(value.wavelengths), list(value.values)
        elif of == "ResolvedReference":
            value = value.index()
        elif of == "Any":
            try:
                value = pickle.dumps(value)
            except Exception as err:
                raise SceneError(
                    message(
                        "the scene holds a value that cannot be sent to a worker",
                        where=f"'{key}' of {label(node, index)}",
                        got=type(value).__name__,
                    )
                ) from err
        properties[key] = of, value
    return _Node(props.plugin_name(), props.id(), node.type.value, node.file_index, node.offset, properties)


def _made(plain: _Node) -> Any:
    import drjit as dr
    import mitsuba as mi
    from mitsuba.mitsuba_ext import Spectrum  # mi.Spectrum is that of the variant

    node, props = mi.parser.SceneNode(), mi.Properties(plain.plugin)
    props.set_id(plain.id)
    for key, (of, value) in plain.properties.items():
        if of == "Vector":
            value = dr.scalar.Array3f64(*value)
        elif of == "Color":
            value = mi.Color3d(*value)
        elif of == "Transform":
            value = mi.AffineTransform4d(*map(dr.scalar.Matrix4f64, value))
        elif of == "Spectrum":
            wavelengths, values = value
            value = Spectrum(wavelengths, values) if wavelengths else Spectrum(values[0])
        elif of == "ResolvedReference":
            value = mi.Properties.ResolvedReference(value)
        elif of == "Any":
            value = pickle.loads(value)
        props[key] = value
    node.props, node.type = props, mi.ObjectType(plain.kind)
    node.file_index, node.offset = plain.file_index, plain.offset
    return node
