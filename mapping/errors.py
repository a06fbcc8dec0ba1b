"""What can go wrong while mapping, as one tree; and the base of the errors of all floors.

MappingError
├── ParameterError         a resolution, range or probability that contradicts itself
├── CapacityError          a map or region that cannot fit, with the number that would
└── RadarDataError         raw radar data, or a radar's configuration, that is cut, unreadable or contradicts itself

Every error says what is wrong, where, and what to do.
"""


class DescribedError(Exception):
    """An error for people: ``what`` is one sentence with the offending value, ``where`` names the file, row,
    field or place, ``advice`` says what to do next. ``code`` is stable, for programs.
    """

    code = "error"

    def __init__(self, what: str, *, where: str = "", advice: str = "") -> None:
        super().__init__(what, where, advice)
        self.what = what
        self.where = where
        self.advice = advice

    def __str__(self) -> str:
        head = f"{self.where}: {self.what}" if self.where else self.what
        return f"{head} {self.advice}" if self.advice else head

    def __reduce__(self) -> tuple[object, ...]:
        return _rebuild, (type(self), self.what, self.where, self.advice)


def _rebuild(cls: type[DescribedError], what: str, where: str, advice: str) -> DescribedError:
    return cls(what, where=where, advice=advice)


class MappingError(DescribedError, ValueError):
    """Base of all errors of this floor."""

    code = "mapping"


class ParameterError(MappingError):
    code = "map_parameter"


class CapacityError(MappingError):
    code = "map_capacity"


class RadarDataError(MappingError):
    code = "radar_data"
