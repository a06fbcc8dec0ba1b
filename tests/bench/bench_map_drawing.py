"""What a map of a million voxels comes to on its way into the 3D view, at once and grown in an hour.

Run alone: ``python -m tests.bench.bench_map_drawing``. The real drawing code on a clock of its own; bytes are those to
one page.
"""

from __future__ import annotations

import time

import numpy as np
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from server.obstacles.drawing import BOXES_MAX, BURST_BYTES, PERIOD_S, RATE_BYTES_S
from server.scene.host import SUBPROTOCOL
from server.scene.mirror import MapMirror
from tests.server.large_maps import Painter, hills, painting, told
from tests.server.obstacle_messages import delta

VOXELS, SIDE = 1_000_000, 1000
MOST_BYTES, MOST_BOXES = 100e6, 200_000
HOUR_S, UNCHANGED_S = 3600, 600
QUIET_S = 2.0


def main() -> None:
    with painting() as painter:
        mirror = MapMirror("radar")
        at_once(painter, mirror)
        unchanged(painter, mirror)
    with painting() as painter:
        grown_in_an_hour(painter)


def at_once(painter: Painter, mirror: MapMirror) -> None:
    began_s = time.perf_counter()
    for part in told(hills(VOXELS, side=SIDE), painter.origin):
        mirror.fold(part)
    folded_s = time.perf_counter()
    painter.finish(mirror)
    print(f"{VOXELS:,} voxels taken in in {folded_s - began_s:.1f} s, drawn in {time.perf_counter() - folded_s:.1f} s")
    (described,) = painter.maps.drawn()
    boxes, sent = sum(painter.stage.boxes.values()), painter.sent_bytes
    print(f"  {described.text}: {boxes:,} boxes (at most {MOST_BOXES:,}: {_yes(boxes <= MOST_BOXES)})")
    print(
        f"  all maps together at most {sum(BOXES_MAX.values()):,} boxes: {_yes(sum(BOXES_MAX.values()) <= MOST_BOXES)}"
    )
    print(f"  {_mb(sent)} sent while it was drawn (at most {_mb(MOST_BYTES)}: {_yes(sent <= MOST_BYTES)})")
    opened = opened_bytes(painter.port)
    print(f"  {_mb(opened)} on the wire to a page that is opened then ({_yes(opened <= MOST_BYTES)})")


def opened_bytes(port: int) -> int:
    """Until the 3D view has nothing more to say."""
    count = 0
    with connect(
        f"ws://127.0.0.1:{port}", subprotocols=[Subprotocol(SUBPROTOCOL)], max_size=None, compression=None
    ) as page:
        while True:
            try:
                count += len(page.recv(timeout=QUIET_S))
            except TimeoutError:
                return count


def unchanged(painter: Painter, mirror: MapMirror) -> None:
    before = painter.sent_bytes
    for _ in range(round(UNCHANGED_S / PERIOD_S)):
        painter.turn(mirror)
    more = painter.sent_bytes - before
    print(f"  {more} bytes in the {UNCHANGED_S / 60:.0f} minutes after it, unchanged (none: {_yes(more == 0)})")


def grown_in_an_hour(painter: Painter) -> None:
    """Row after row, second by second, the vehicle above what is new."""
    mirror = MapMirror("radar")
    for second, keys in enumerate(np.array_split(hills(VOXELS, side=SIDE), HOUR_S), start=1):
        mirror.fold(delta(keys, 200, origin=painter.origin, revision=second, since=second - 1))
        east, north, up = keys[-1].tolist()
        for _ in range(round(1 / PERIOD_S)):
            painter.turn(mirror, (east, north, up + 5.0))
    sent, limit = painter.sent_bytes, BURST_BYTES + RATE_BYTES_S * HOUR_S
    print(
        f"grown to {VOXELS:,} voxels in an hour: {_mb(sent)} sent (at most {_mb(MOST_BYTES)}: "
        f"{_yes(sent <= MOST_BYTES)}); a map that changes everywhere all the time: at most {_mb(limit)} an hour"
    )


def _mb(count: float) -> str:
    return f"{count / 1e6:.1f} MB"


def _yes(good: bool) -> str:
    return "yes" if good else "NO"


if __name__ == "__main__":
    main()
