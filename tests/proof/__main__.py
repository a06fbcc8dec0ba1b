"""`make proof`: plan missions over every model, prove each slowly, print the table; 1 where a certificate is wrong."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from server.work.cluster import spread
from tests.proof.missions import Proved, Prover
from tests.proof.models import GRIDS, Model, recorded, seeded

MOST_OVER_M, MOST_UNDER_M = 0.001, 0.01
LEAST_MISSIONS = 200
PER_RECORDED, PER_SEEDED, SEEDS = 9, 3, (1, 2, 3, 4)
TRIES = 8
"""Seeds tried for one mission: points may lie where none can be planned."""
RECORDED = Path(__file__).resolve().parents[3] / "shared" / "data" / "dsm"


Piece = tuple[Model | tuple[str, int], int]
"""A recorded model, or kind and seed of one, and how many missions over it."""


@dataclass(frozen=True)
class Row:
    """What was found over one model."""

    name: str
    proved: tuple[Proved, ...]

    @property
    def over_m(self) -> float:
        return max(found.over_m for found in self.proved)

    @property
    def under_m(self) -> float:
        return max(-found.over_m for found in self.proved)

    def __str__(self) -> str:
        nearest = min(found.true_m for found in self.proved)
        return f"{self.name:24}{len(self.proved):9}{nearest:15.3f}{1000 * self.over_m:18.3f}{1000 * self.under_m:18.3f}"


def main() -> int:
    """Prints one row for each model and the worst of all; 0 where every certificate agrees."""
    parser = argparse.ArgumentParser(prog="make proof PROOF_ARGS=", description="Prove certificates by brute force.")
    parser.add_argument("--cluster", metavar="local|ADDRESS", help="spread over Dask workers")
    cluster = parser.parse_args().cluster
    started = time.perf_counter()
    print(f"{'model':24}{'missions':>9}{'nearest (m)':>15}{'over (mm)':>18}{'pessimism (mm)':>18}", flush=True)
    rows = []
    for row in _rows(cluster):
        rows.append(row)
        print(row, flush=True)
    count = sum(len(row.proved) for row in rows)
    over_m, under_m = max(row.over_m for row in rows), max(row.under_m for row in rows)
    print(
        f"{count} missions in {time.perf_counter() - started:.0f} s: at worst {1000 * over_m:.3f} mm over-certified"
        f" (at most {1000 * MOST_OVER_M:g}), {1000 * under_m:.3f} mm too cautious (at most {1000 * MOST_UNDER_M:g})."
    )
    if count < LEAST_MISSIONS:
        print(f"Fewer than {LEAST_MISSIONS} missions were proved.")
    return int(over_m > MOST_OVER_M or under_m > MOST_UNDER_M or count < LEAST_MISSIONS)


def _rows(cluster: str | None) -> Iterator[Row]:
    if not RECORDED.is_dir():
        print(f"No recorded models: {RECORDED.name} is not beside the project.")
    found = recorded(RECORDED) if RECORDED.is_dir() else []
    per_seeded = PER_SEEDED if RECORDED.is_dir() else 2 * PER_SEEDED
    pieces: list[Piece] = [(model, PER_RECORDED) for model in found]
    pieces += [((kind, seed), per_seeded) for kind in GRIDS for seed in SEEDS]
    proved = spread(_proved, pieces, cluster, lambda share: None)
    for model in found:
        yield Row(model.name, next(proved))
    for kind in GRIDS:
        yield Row(kind, tuple(one for of_seed in islice(proved, len(SEEDS)) for one in of_seed))


def _proved(piece: Piece) -> tuple[Proved, ...]:
    model, missions = piece
    with tempfile.TemporaryDirectory(prefix="hedgehop-proof-") as folder:
        prover = Prover(model if isinstance(model, Model) else seeded(Path(folder), *model))
        tries = (prover.prove(seed) for seed in range(missions * TRIES))
        return tuple(islice((found for found in tries if found is not None), missions))


if __name__ == "__main__":
    sys.exit(main())
