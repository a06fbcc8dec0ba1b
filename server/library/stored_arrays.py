"""Arrays as ``.npy`` files that can be memory-mapped: a model of 132 Mpx opens at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from server.errors import StorageError
from server.library.whole_files import write_durably

_CHUNK_BYTES = 16 * 1024**2


def write_array(path: Path, array: NDArray[Any]) -> None:
    """numpy's own writer hides why a write failed ("disk full"), so the bytes are written here."""
    contiguous = np.ascontiguousarray(array)

    def fill(file: BinaryIO) -> None:
        np.lib.format.write_array_header_2_0(file, np.lib.format.header_data_from_array_1_0(contiguous))
        data = contiguous.reshape(-1).view(np.uint8)
        for start in range(0, data.size, _CHUNK_BYTES):
            file.write(data[start : start + _CHUNK_BYTES].data)

    write_durably(path, fill)


def read_array(path: Path, *, shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray[Any]:
    """Memory-mapped and read-only; raises ``StorageError`` when it is not what the manifest says."""
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError) as error:
        raise _damaged(path, str(error)) from error
    if array.shape != shape or array.dtype != dtype:
        raise _damaged(path, f"it holds {array.dtype} {array.shape}, not {np.dtype(dtype)} {shape}")
    return array


def _damaged(path: Path, why: str) -> StorageError:
    return StorageError(f"The file is damaged: {why}.", where=str(path), advice="Delete the entry and add it again.")
