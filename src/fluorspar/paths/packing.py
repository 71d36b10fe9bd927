"""Pack and unpack the entries of a log, compiled; see `packed.py`.

The byte of a term says which numbers there are of it, `sampled` in that of the first term. The weight is one of three:
0, 1, or a number. What follows the bytes, in the order of blocks, entries and lanes: `sampled`, then `direct` and
`weight` of each term; and the rows of the lights of `sampled` and of `direct`, one for all terms.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numba
import numpy as np

from fluorspar.paths.sweeping.kept_code import keep_code

__all__ = ["DIRECT", "NUMBER", "ONE", "SAMPLED", "kernels"]

DIRECT, ONE, NUMBER, SAMPLED = 1, 2, 4, 8


@cache
def kernels() -> Mapping[str, Callable[..., None]]:
    """The kernels, by name; compiled code is kept on disk."""
    doing = {"count": "counting", "fill": "packing", "unpack": "unpacking", "check": "checking"}
    for name, kernel in _KERNELS.items():
        keep_code(kernel, f"the {doing[name]} of light paths")
    return _KERNELS


@numba.njit(nogil=True, _nrt=False)
def _count(first: Any, stop: Any, log: Any, strips: Any, rows: Any, says: Any, counts: Any, end: Any) -> None:
    """Write rows and bytes of the blocks from `first` to `stop`, and how many numbers and lights each has."""
    terms, _, lanes = rows.shape
    none = rows.dtype.type(-1)
    for block in range(first, stop):
        numbers = lights = 0
        begin, height = log.strips[block, 0], strips[block, 1] - strips[block, 0]
        for t in range(height):
            to = strips[block, 0] + t
            for lane in range(lanes):
                there = t < log.used[block * lanes + lane]
                i = (begin + t) * lanes + lane
                lit = False
                for term in range(terms):
                    byte, row = 0, none
                    k = i + term * len(log.sampled)
                    if there:
                        if log.row[k] != end:
                            row = rows.dtype.type(log.row[k])
                        if term == 0 and log.sampled[i] != 0:
                            byte |= SAMPLED
                            numbers += 1
                            lights += 1
                        if log.direct[k] != 0:
                            byte |= DIRECT
                            numbers += 1
                            lit = True
                        if log.weight[k] == 1:
                            byte |= ONE
                        elif log.weight[k] != 0:
                            byte |= NUMBER
                            numbers += 1
                    rows[term, to, lane] = row
                    says[term, to, lane] = byte
                if lit:
                    lights += 1
        counts[block, 0], counts[block, 1] = numbers, lights


@numba.njit(nogil=True, _nrt=False)
def _fill(
    first: Any,
    stop: Any,
    log: Any,
    strips: Any,
    says: Any,
    starts: Any,
    numbers: Any,
    lights: Any,
    several: Any,
) -> None:
    """Write the numbers and the lights of the blocks from `first` to `stop`."""
    terms, _, lanes = says.shape
    for block in range(first, stop):
        n, m = starts[block, 0], starts[block, 1]
        begin = log.strips[block, 0] - strips[block, 0]
        for at in range(strips[block, 0], strips[block, 1]):
            for lane in range(lanes):
                i = (begin + at) * lanes + lane
                if says[0, at, lane] & SAMPLED:
                    numbers[n] = log.sampled[i]
                    n += 1
                    if several:
                        lights[m] = log.sampled_light[i]
                        m += 1
                lit = False
                for term in range(terms):
                    byte, k = says[term, at, lane], i + term * len(log.sampled)
                    if byte & DIRECT:
                        numbers[n] = log.direct[k]
                        n += 1
                        lit = True
                    if byte & NUMBER:
                        numbers[n] = log.weight[k]
                        n += 1
                if lit and several:
                    lights[m] = log.direct_light[i]
                    m += 1


@numba.njit(nogil=True, _nrt=False)
def _unpack(
    first: Any,
    stop: Any,
    rows: Any,
    says: Any,
    strips: Any,
    starts: Any,
    numbers: Any,
    lights: Any,
    several: Any,
    row_of: Any,
    beyond: Any,
    log: Any,
    end: Any,
) -> None:
    """Write the log of the blocks from `first` to `stop`."""
    terms, _, lanes = rows.shape
    none = rows.dtype.type(-1)
    for block in range(first, stop):
        n, m = starts[block, 0], starts[block, 1]
        for at in range(strips[block, 0], strips[block, 1]):
            for lane in range(lanes):
                i = at * lanes + lane
                sampled = np.float32(0)
                if says[0, at, lane] & SAMPLED:
                    sampled = numbers[n]
                    n += 1
                    if several:
                        log.sampled_light[i] = lights[m]
                        m += 1
                elif several:
                    log.sampled_light[i] = 0
                log.sampled[i] = sampled
                lit = False
                for term in range(terms):
                    byte, row = says[term, at, lane], rows[term, at, lane]
                    k = i + term * len(log.sampled)
                    direct, weight = np.float32(0), np.float32(0)
                    if byte & DIRECT:
                        direct = numbers[n]
                        n += 1
                        lit = True
                    if byte & ONE:
                        weight = np.float32(1)
                    elif byte & NUMBER:
                        weight = numbers[n]
                        n += 1
                    log.direct[k], log.weight[k] = direct, weight
                    if row == none:
                        log.row[k] = end
                    elif row < len(row_of):
                        log.row[k] = row_of[row]
                    else:
                        log.row[k] = row + beyond
                if several:
                    log.direct_light[i] = 0
                    if lit:
                        log.direct_light[i] = lights[m]
                        m += 1


@numba.njit(nogil=True, _nrt=False)
def _check(first: Any, stop: Any, rows: Any, says: Any, strips: Any, counts: Any) -> None:
    """Write how many numbers and lights the blocks from `first` to `stop` have by their bytes, and the largest row."""
    terms, _, lanes = rows.shape
    none = rows.dtype.type(-1)
    for block in range(first, stop):
        numbers = lights = 0
        largest = np.int64(0)
        for at in range(strips[block, 0], strips[block, 1]):
            for lane in range(lanes):
                lit = False
                for term in range(terms):
                    byte, row = says[term, at, lane], rows[term, at, lane]
                    if row != none:
                        largest = np.int64(row) if row > largest else largest
                    if term == 0 and byte & SAMPLED:
                        numbers += 1
                        lights += 1
                    if byte & DIRECT:
                        numbers += 1
                        lit = True
                    if byte & NUMBER and not byte & ONE:
                        numbers += 1
                if lit:
                    lights += 1
        counts[block, 0], counts[block, 1], counts[block, 2] = numbers, lights, largest


_KERNELS: Mapping[str, Callable[..., None]] = {
    "count": _count,
    "fill": _fill,
    "unpack": _unpack,
    "check": _check,
}
