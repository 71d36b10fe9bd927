"""Compiled code for Phi E, the integral of D_L E over excitation (Eq. 7 of the paper), up to the Stokes limit.

Written out, band j of one fluorophore's luminescence is alpha_j times a running sum over the bands below. A sum that
waits for itself band by band takes half the time of a sweep, so one register of bands at a time is summed by shifts
and additions, in the compiler's own vector instructions.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from fluorspar.paths.sweeping.spectral_tables import LANES

__all__ = ["luminesce"]

_FLOAT = ir.FloatType()
_INT = ir.IntType(32)
_REGISTER = ir.VectorType(_FLOAT, LANES)


@numba.njit(inline="always")
def luminesce(out: Any, light: Any, scale: Any, row: int, width: int, tables: Any) -> None:
    """Add `scale` times Phi E to `out`, with E = `light`; both of shape (width,), and not the same."""
    full = tables.full[row]
    if full >= 0:
        for ex in range(width):
            e = scale * light[ex]
            for j in range(width):
                out[j] += tables.matrices[full, ex, j] * e
    for q in range(tables.first[row], tables.last[row]):
        below = np.float32(0)
        for start in range(0, width, LANES):
            below = _luminesce_register(
                out, light, tables.alpha, tables.beta, start, q * width + start, below, tables.equal, scale
            )


@intrinsic
def _luminesce_register(
    context: Any,
    out: Any,
    light: Any,
    alpha: Any,
    beta: Any,
    start: Any,
    start_of_dye: Any,
    below: Any,
    equal: Any,
    scale: Any,
) -> Any:
    """Luminescence of bands `start` to `start + LANES`, one register; `below` is the sum over all bands before them.

    With x = beta light, `out` gains scale alpha_j (below + sum of x_i for i < j + equal x_j). Returns the sum over the
    bands before the next register. The sum over a register takes log2(LANES) steps: add the register shifted
    by 1, by 2, by 4, ... In the flat tables `alpha` and `beta` the bands are at `start_of_dye`.
    """
    signature = types.float32(
        out, light, alpha, beta, types.intp, types.intp, types.float32, types.float32, types.float32
    )

    def generate(target: Any, builder: Any, called: Any, arguments: Any) -> Any:
        def address(n: int) -> Any:
            array = target.make_array(called.args[n])(target, builder, arguments[n])
            place = arguments[4] if n < 2 else arguments[5]
            return builder.bitcast(builder.gep(array.data, [place]), _REGISTER.as_pointer())

        def load(n: int) -> Any:
            value = builder.load(address(n))
            value.align = 4
            return value

        def choose(values: Any, others: Any, indices: list[int]) -> Any:
            return builder.shuffle_vector(values, others, ir.Constant(ir.VectorType(_INT, LANES), indices))

        nothing = ir.Constant(_REGISTER, ir.Undefined)
        zero = ir.Constant(_REGISTER, [0.0] * LANES)

        def shifted(values: Any, by: int) -> Any:
            return choose(values, zero, [LANES] * by + list(range(LANES - by)))

        def everywhere(number: Any) -> Any:
            return choose(builder.insert_element(nothing, number, ir.Constant(_INT, 0)), nothing, [0] * LANES)

        absorbed = builder.fmul(load(1), load(3))
        total = absorbed
        for step in range(LANES.bit_length() - 1):
            total = builder.fadd(total, shifted(total, 1 << step))
        here = builder.fmul(everywhere(arguments[7]), absorbed)
        excited = builder.fadd(builder.fadd(shifted(total, 1), here), everywhere(arguments[6]))
        emitted = builder.fmul(builder.fmul(everywhere(arguments[8]), load(2)), excited)
        stored = builder.store(builder.fadd(load(0), emitted, flags=("contract",)), address(0))
        stored.align = 4
        return builder.fadd(arguments[6], builder.extract_element(total, ir.Constant(_INT, LANES - 1)))

    return signature, generate
