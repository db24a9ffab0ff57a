"""Arguments as the library takes them: contiguous arrays of float64 or complex128, and whole numbers."""

from __future__ import annotations

import sys
from operator import index
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


def whole(name: str, value: Any, least: int = 1) -> int:
    """Returns a whole number that is not below the least one.

    Raises:
        InputError: The value is no whole number, too small, or larger than any count of this machine.
    """
    try:
        number = index(value)
    except TypeError:
        raise InputError(f"{name}: {value!r} is no whole number; give one") from None
    if number > sys.maxsize:
        raise InputError(f"{name}: the number is too large; give a smaller one")
    if number < least:
        raise InputError(f"{name}: {number} is not allowed; give a whole number of at least {least}")
    return number


def _numbers(name: str, values: ArrayLike) -> NDArray[Any]:
    try:
        array = np.asarray(values)
    except ValueError as cause:
        raise InputError(f"{name}: rows of different lengths; give equal ones") from cause
    if array.dtype.kind not in "biufc":
        raise InputError(f"{name}: values of type {array.dtype} are no numbers; give numbers")
    return array
