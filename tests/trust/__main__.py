"""`make trust`: try every promise of docs/security.md, print the table; 1 where one is broken."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator

from tests.trust.attempts import attempt_rows
from tests.trust.growth import growth_row
from tests.trust.link import link_rows
from tests.trust.missions import missions_row
from tests.trust.pages import PAGES, pages_row
from tests.trust.rows import Row


def main() -> int:
    parser = argparse.ArgumentParser(prog="trust", description="Tries what docs/security.md promises.")
    parser.add_argument("--mutations", type=int, default=10_000, help="changed missions (R16)")
    parser.add_argument("--uploads", type=int, default=50, help="for each kind of vehicle (R1, R3)")
    parser.add_argument("--cuts", type=int, default=500, help="for each kind of vehicle (R2)")
    parser.add_argument("--frames", type=int, default=1_000_000, help="hostile datagrams (R7)")
    parser.add_argument("--hours", type=float, default=2.0, help="of flight on a virtual clock (R15)")
    parser.add_argument("--pages", type=int, default=PAGES, help="browsers at once (R14)")
    options = parser.parse_args()
    started_s = time.perf_counter()
    rows = []
    for row in _rows(options):
        rows.append(row)
        print(row, flush=True)
    failed = sum(row.verdict == "FAILS" for row in rows)
    print(f"{len(rows)} rows in {time.perf_counter() - started_s:.0f} s: {len(rows) - failed} holds, {failed} FAILS.")
    return int(failed > 0)


def _rows(options: argparse.Namespace) -> Iterator[Row]:
    yield from link_rows(uploads=options.uploads, cuts=options.cuts, commands=200, frames=options.frames)
    yield missions_row(options.mutations)
    yield growth_row(options.hours)
    yield pages_row(options.pages)
    yield from attempt_rows()


if __name__ == "__main__":
    raise SystemExit(main())
