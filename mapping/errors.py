"""What can go wrong while mapping, as one tree.

MappingError
├── ParameterError         a resolution, range or probability that contradicts itself
├── CapacityError          a map or region that cannot fit, with the number that would
└── FormatError            a map file that cannot be read or a map that cannot be written

Every error says what is wrong, where, and what to do.
"""


class MappingError(ValueError):
    """Base of all errors of this floor: ``what`` is one sentence with the offending value, ``where`` names the field or
    place, ``advice`` says what to do next. ``code`` is stable, for programs.
    """

    code = "mapping"

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


def _rebuild(cls: type[MappingError], what: str, where: str, advice: str) -> MappingError:
    return cls(what, where=where, advice=advice)


class ParameterError(MappingError):
    code = "map_parameter"


class CapacityError(MappingError):
    code = "map_capacity"


class FormatError(MappingError):
    code = "map_format"
