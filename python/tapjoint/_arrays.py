"""Arrays of any kind as the library takes them: contiguous float64 or complex128."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Real = NDArray[np.float64]
    Complex = NDArray[np.complex128]


def real(name: str, values: ArrayLike) -> Real:
    """Returns the values as a contiguous float64 array. Such an array is not copied.

    Raises:
        InputError: The values are complex, or no numbers.
    """
    array = _numbers(name, values)
    if array.dtype.kind == "c":
        raise InputError(f"{name}: complex values are not allowed; give real ones")
    return np.ascontiguousarray(array, dtype=np.float64)


def complex_values(name: str, values: ArrayLike) -> Complex:
    """Returns the values as a contiguous complex128 array. Such an array is not copied.

    Raises:
        InputError: The values are no numbers.
    """
    return np.ascontiguousarray(_numbers(name, values), dtype=np.complex128)


def _numbers(name: str, values: ArrayLike) -> NDArray[Any]:
    try:
        array = np.asarray(values)
    except ValueError as cause:
        raise InputError(f"{name}: rows of different lengths; give equal ones") from cause
    if array.dtype.kind not in "biufc":
        raise InputError(f"{name}: values of type {array.dtype} are no numbers; give numbers")
    return array
