"""Sobol's sequence. SciPy has it too, but takes half a second to import, a quarter of a small render.

References
----------
S. Joe and F. Y. Kuo, "Constructing Sobol sequences with better two-dimensional projections", SIAM J. Sci. Comput. 30,
2008: the polynomials and first directions. I. A. Antonov and V. M. Saleev, "An economic method of computing
LP-tau-sequences", USSR Comput. Math. Math. Phys. 19(1), 1979: the order of the points, by a Gray code.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["MOST_DIMENSIONS", "sobol_points"]

# Of each dimension but the first, a polynomial over {0, 1}, whose coefficients are the bits, and the first directions.
_DIRECTIONS = (
    (0b11, (1,)),
    (0b111, (1, 3)),
    (0b1011, (1, 3, 1)),
    (0b1101, (1, 1, 1)),
    (0b10011, (1, 1, 3, 3)),
    (0b11001, (1, 3, 5, 13)),
    (0b100101, (1, 1, 5, 5, 17)),
    (0b101001, (1, 1, 5, 5, 5)),
    (0b101111, (1, 1, 7, 11, 19)),
    (0b110111, (1, 1, 5, 1, 1)),
    (0b111011, (1, 1, 1, 3, 11)),
    (0b111101, (1, 3, 5, 5, 31)),
    (0b1000011, (1, 3, 3, 9, 7, 49)),
    (0b1011011, (1, 1, 1, 15, 21, 21)),
    (0b1100001, (1, 3, 1, 13, 27, 49)),
)
MOST_DIMENSIONS = 1 + len(_DIRECTIONS)


def sobol_points(dimensions: int, bits: int) -> NDArray[np.uint32]:
    """The first 2^bits points, without scrambling.

    Parameters
    ----------
    dimensions : int
        Up to `MOST_DIMENSIONS`.
    bits : int

    Returns
    -------
    ndarray of shape (dimensions, 2^bits)
        In units of 2^-bits.

    Examples
    --------
    >>> sobol_points(2, 2)
    array([[0, 2, 3, 1],
           [0, 2, 1, 3]], dtype=uint32)
    """
    numbers = np.arange(1 << bits)
    gray = numbers ^ (numbers >> 1)
    points = np.zeros((dimensions, 1 << bits), np.uint32)
    for dimension, row in enumerate(points):
        for bit, direction in enumerate(_directions(dimension, bits)):
            row ^= ((gray >> bit & 1) * (direction << bits - 1 - bit)).astype(np.uint32)
    return points


def _directions(dimension: int, count: int) -> list[int]:
    if dimension == 0:
        return [1] * count
    polynomial, first = _DIRECTIONS[dimension - 1]
    found, degree = list(first), len(first)
    while len(found) < count:
        term = found[-degree]
        for back in range(1, degree + 1):
            if polynomial >> degree - back & 1:
                term ^= found[-back] << back
        found.append(term)
    return found[:count]
