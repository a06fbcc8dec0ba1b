"""What is loaded to stay is kept from the collector of cycles.

To find cycles the collector looks through all that lives, and every thread waits: 0.2 s once schemas and kernels are
there, at moments of its own choosing.
"""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_lock = threading.Lock()
_loads = 0


@contextmanager
def loaded_to_stay() -> Iterator[None]:
    """The collector rests meanwhile, in all threads, and never looks at what there is afterwards."""
    global _loads
    with _lock:
        _loads += 1
        gc.disable()
    try:
        yield
    finally:
        with _lock:
            _loads -= 1
            gc.freeze()
            if _loads == 0:
                gc.enable()
