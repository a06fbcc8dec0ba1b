"""The files that a mesh is made of: one file, or a ZIP archive in which names lead nowhere but into it."""

from __future__ import annotations

import base64
import binascii
import posixpath
import zipfile
from pathlib import Path
from urllib.parse import unquote

from planning.errors import RasterFormatError, RasterTooLargeError

MOST_FILE_BYTES = 512 * 2**20
MOST_BYTES = 4 * 2**30
"""Of all files together, each as often as it is read."""
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_PASSWORD = 1
_INSIDE = "Pack all files of the mesh into one ZIP and name them by relative paths."


class Package:
    """Reads no more than its bounds allow. Raises RasterFormatError, RasterTooLargeError."""

    def __init__(self, path: Path, entry: str | None) -> None:
        """``entry``: the file of the archive with which the mesh begins; None: the path is no archive."""
        self._path, self._archive = path, None if entry is None else zipfile.ZipFile(path)
        self.entry = entry or path.name
        infos = [] if self._archive is None else self._archive.infolist()
        self._infos = {info.filename: info for info in infos}
        self._read = 0

    def read(self, name: str) -> bytes:
        if self._archive is None:
            if name != self.entry:
                raise RasterFormatError(f"It needs another file, {name[-80:]}, beside it.", advice=_INSIDE)
            self._count(self._path.stat().st_size)
            return self._path.read_bytes()
        info = self._infos.get(name)
        if info is None:
            raise RasterFormatError(f"It names {name[-80:]}, which is not in the archive.", advice=_INSIDE)
        if info.flag_bits & _PASSWORD or info.compress_type not in _METHODS:
            what = f"{name[-80:]} has a password, or is packed by another way than deflate."
            raise RasterFormatError(what, advice="Pack it again as ZIP with deflate, without a password.")
        self._count(info.file_size)
        with self._archive.open(info) as file:
            data = file.read(info.file_size + 1)
        if len(data) != info.file_size:
            raise RasterFormatError(f"{name[-80:]} is shorter than the archive says.", advice="Pack it again.")
        return data

    def named(self, base: str, uri: object) -> str:
        """The archive's file that ``uri`` names in the file ``base``; addresses and ways out of it are refused."""
        if not isinstance(uri, str):
            raise RasterFormatError("One of its parts names no file.", advice="Export it again.")
        if "://" in uri or uri.startswith(("/", "\\")) or ":" in uri.split("/", 1)[0] or "\\" in uri:
            what = f"It names a file elsewhere, {uri[:80]}: nothing is read from outside of it."
            raise RasterFormatError(what, advice=_INSIDE)
        plain = unquote(uri.split("?", 1)[0].split("#", 1)[0])
        name = posixpath.normpath(posixpath.join(posixpath.dirname(base), plain))
        if name.startswith(("..", "/")) or "\\" in plain or "\0" in plain:
            raise RasterFormatError(f"It names a file outside of it, {uri[:80]}.", advice=_INSIDE)
        return name

    def follow(self, base: str, uri: object) -> bytes:
        """What a file names, or holds in its own text."""
        if isinstance(uri, str) and uri.startswith("data:"):
            _, _, text = uri.partition(";base64,")
            try:
                return base64.b64decode(text, validate=True)
            except binascii.Error:
                raise RasterFormatError("Data inside of its text is damaged.", advice="Export it again.") from None
        return self.read(self.named(base, uri))

    def _count(self, size: int) -> None:
        self._read += size
        if size > MOST_FILE_BYTES or self._read > MOST_BYTES:
            what = f"A file of {size / 1e6:,.0f} MB in it, or all of them, are more than is read."
            raise RasterTooLargeError(what, advice="Export the mesh with fewer faces, or as 3D Tiles.")
