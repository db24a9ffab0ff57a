"""Functions and modes of arrays, with types that mypy checks."""

from __future__ import annotations

import numpy as np

import tapjoint


def strongest(rate: float, force: list[list[float]], response: list[list[float]]) -> float:
    """Returns the frequency (Hz) of the largest H1."""
    functions: tapjoint.FrequencyResponses = tapjoint.frf(force, response, rate)
    return float(functions.frequency[np.abs(functions.h1).argmax()])


def joint(test: tapjoint.Test) -> float | None:
    """Returns the rotational stiffness (N m/rad); None where these data give none."""
    try:
        result: tapjoint.Result = tapjoint.identify(test)
    except tapjoint.NoAnswerError as error:
        print(error.result.text)
        return None
    return float(result.estimate.kr.value)


if __name__ == "__main__":
    print(strongest(64.0, [[1.0] + [0.0] * 63] * 2, [[0.5, 0.25] + [0.0] * 62] * 2))
