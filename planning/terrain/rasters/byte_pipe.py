"""A file that the decoding process reads through a pipe: it asks for bytes, its parent answers.

A question is offset and count, an answer a count and so many bytes; a count below zero says that they cannot be had.
"""

from __future__ import annotations

import contextlib
import io
import os
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from planning.errors import RasterError

_QUESTION, _COUNT = struct.Struct(">QQ"), struct.Struct(">q")
_FAILED = -1


@dataclass(slots=True)
class Served:
    """The child's ends of the pipes, and what went wrong at this one."""

    child: tuple[int, int]
    """Where it reads answers and writes questions."""
    error: RasterError | None = field(default=None)


@contextmanager
def served(read: Callable[[int, int], bytes], stop: Callable[[], None]) -> Iterator[Served]:
    """Answers questions by ``read(offset, count)`` from a thread, until the child has closed its ends.

    ``stop`` ends a read that is under way, and lets no other begin: it is called when this ends by an error.
    """
    questions, asks = os.pipe()
    hears, answers = os.pipe()
    end = Served((hears, asks))
    thread = threading.Thread(target=_answer, args=(questions, answers, read, end), daemon=True)
    thread.start()
    try:
        yield end
    except BaseException:
        stop()
        raise
    finally:
        for handle in end.child:
            os.close(handle)
        thread.join()


def _answer(questions: int, answers: int, read: Callable[[int, int], bytes], end: Served) -> None:
    # A child that has ended reads no answer.
    with contextlib.suppress(BrokenPipeError), os.fdopen(questions, "rb") as asked, os.fdopen(answers, "wb") as out:
        while len(question := asked.read(_QUESTION.size)) == _QUESTION.size:
            try:
                data = read(*_QUESTION.unpack(question))
                count = len(data)
            except RasterError as error:
                end.error, data, count = end.error or error, b"", _FAILED
            except Exception as error:  # the child must not wait for an answer that never comes
                end.error, data, count = RasterError(f"Its bytes cannot be had ({error!r})."), b"", _FAILED
            out.write(_COUNT.pack(count) + data)
            out.flush()


class Asking:
    """The child's end."""

    def __init__(self, hears: int, asks: int) -> None:
        self._in, self._out = os.fdopen(hears, "rb"), os.fdopen(asks, "wb")
        self._failed = False

    def bytes_at(self, offset: int, count: int) -> bytes:
        """One to ``count`` bytes. Raises OSError where the parent cannot have them, and from then on."""
        self.check()
        self._out.write(_QUESTION.pack(offset, count))
        self._out.flush()
        head = self._in.read(_COUNT.size)
        found = _COUNT.unpack(head)[0] if len(head) == _COUNT.size else _FAILED
        data = self._in.read(found) if 0 < found <= count else b""
        self._failed = not data or len(data) != found
        self.check()
        return data

    def check(self) -> None:
        """OSError when any bytes were not had: decoders do without what is not vital to them."""
        if self._failed:
            raise OSError("the bytes cannot be had")


class PipeFile(io.RawIOBase):
    """A file for decoders, whose bytes are asked for."""

    def __init__(self, asking: Asking, size_bytes: int) -> None:
        super().__init__()
        self._asking, self._size, self._at = asking, size_bytes, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._at

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._size}[whence]
        return self._at

    def read(self, size: int = -1) -> bytes:
        left = max(0, self._size - self._at)
        wanted = left if size < 0 else min(size, left)
        pieces: list[bytes] = []
        while wanted > 0:
            piece = self._asking.bytes_at(self._at, wanted)
            pieces.append(piece)
            wanted, self._at = wanted - len(piece), self._at + len(piece)
        return b"".join(pieces)
