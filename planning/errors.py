"""What can go wrong while planning, as one tree.

PlanningError
├── RasterError            a surface model or orthomosaic that cannot be used
│   ├── RasterFormatError      not a GeoTIFF or ESRI ASCII grid, corrupt, truncated
│   ├── RasterTooLargeError    more pixels or larger blocks than the limits allow
│   ├── MissingCrsError        no coordinate reference system: asks for one
│   └── NoElevationError       every cell is unknown
├── PoiError               a point of interest or polygon that cannot be flown
│   └── NothingLeftError       a survey of whose lines the fence leaves nothing
├── ParameterError         a radius, speed or limit that contradicts itself or the terrain
├── DatumError             an altitude is asked for in a datum nobody declared
├── MissionError           a mission that no vehicle can hold or that cannot be judged
│   └── CapacityError          more items than the vehicle's limit
└── FormatError            a mission, POI or profile file that cannot be read

Every error says what is wrong, where, and what to do.
"""

from mapping.errors import DescribedError as DescribedError


class PlanningError(DescribedError, ValueError):
    """Base of all planning errors."""

    code = "planning"


class RasterError(PlanningError):
    code = "raster"


class RasterFormatError(RasterError):
    code = "raster_format"


class RasterTooLargeError(RasterError):
    code = "raster_too_large"


class MissingCrsError(RasterError):
    code = "raster_no_crs"


class NoElevationError(RasterError):
    code = "raster_no_elevation"


class PoiError(PlanningError):
    code = "poi"


class NothingLeftError(PoiError):
    pass


class ParameterError(PlanningError):
    code = "parameter"


class DatumError(PlanningError):
    code = "datum"


class MissionError(PlanningError):
    code = "mission"


class CapacityError(MissionError):
    code = "mission_capacity"


class FormatError(PlanningError):
    code = "format"
