"""The array types, one name each: letter and bits of the element; the shape stands where the array is used."""

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I8 = NDArray[np.int8]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]
U16 = NDArray[np.uint16]
U32 = NDArray[np.uint32]
U64 = NDArray[np.uint64]
C64 = NDArray[np.complex64]
C128 = NDArray[np.complex128]
Bools = NDArray[np.bool_]
