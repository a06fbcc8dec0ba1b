"""A configuration file of TI's radars, taken apart: one command a line, its numbers, and where it stands."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from mapping.errors import RadarDataError

LONGEST_FILE_BYTES = 100_000


@dataclass(frozen=True, slots=True)
class Command:
    """``profileCfg 0 77 ...`` and the number of its line."""

    line: int
    name: str
    values: tuple[str, ...]
    file: str

    @property
    def text(self) -> str:
        return " ".join((self.name, *self.values))

    def number(self, index: int, what: str) -> float:
        """Raises RadarDataError naming line and value."""
        if not 0 <= index < len(self.values):
            raise self.error(f"{self.name} has {len(self.values)} values, and {what} is not among them.")
        try:
            value = float(self.values[index])
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.error(f'{self.name}: {what} is "{self.values[index]}".')
        return value

    def whole(self, index: int, what: str) -> int:
        value = self.number(index, what)
        if not value.is_integer():
            raise self.error(f"{self.name}: {what} is {value:g}, which is no whole number.")
        return int(value)

    def error(self, what: str) -> RadarDataError:
        return RadarDataError(
            what, where=f"{self.file}, line {self.line}", advice="Compare it with the demo's own configurations."
        )


def read_commands(path: Path) -> tuple[Command, ...]:
    """Raises RadarDataError for what is no such file, and OSError."""
    data = path.read_bytes()
    if len(data) > LONGEST_FILE_BYTES or b"\0" in data:
        raise RadarDataError(
            "This is no radar configuration: it is binary, or far too long.",
            where=path.name,
            advice="Give the .cfg file, lines of text that the demo's visualizer saved.",
        )
    return parse_commands(data.decode("utf-8", "replace"), file=path.name)


def parse_commands(text: str, *, file: str) -> tuple[Command, ...]:
    """Comments (%) and empty lines are left out. Raises RadarDataError where nothing is left."""
    commands: list[Command] = []
    for number, line in enumerate(text.splitlines(), start=1):
        name, *values = line.split("%", 1)[0].split() or [""]
        if name:
            if not (name.isascii() and name.isprintable()):
                raise RadarDataError(f"{name[:20]!r} is no command of a radar.", where=f"{file}, line {number}")
            commands.append(Command(number, name, tuple(values), file))
    if not commands:
        raise RadarDataError("There is no command in it.", where=file, advice="Give the radar's .cfg file.")
    return tuple(commands)
