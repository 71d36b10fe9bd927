"""What a vertex among general surfaces makes of light, in the compiler's own vector instructions.

Some registers of bands at a time and all terms of the vertex, so that sums stay in registers: loops over bands, one for
each term and sum, take three times as long. The spectrum of a texel needs no square root and no division.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from fluorspar.paths.sweeping.spectral_tables import LANES

__all__ = ["collect", "colour", "reflect"]

_INT = ir.IntType(32)
_REGISTER, _INTEGERS = ir.VectorType(ir.FloatType(), LANES), ir.VectorType(_INT, LANES)
_PLACE = ir.IntType(64)
_BLOCK = 8  # of 32 registers; each holds two sums
_MAGIC = 0x5F3759DF  # less half of the bits of a number: those of its reciprocal square root, to 3 %
_FLAGS = ("contract", "reassoc", "nsz")


@intrinsic(prefer_literal=True)
def reflect(context: Any, path: Any, tables: Any, k: Any, width: Any) -> Any:
    """At vertex k of a `LobePath` R becomes A (h L_b + R) + B L_a; A is kept. `width` must be a constant."""

    def generate(target: Any, builder: Any, called: Any, arguments: Any) -> Any:
        code = _Code(target, builder, called, arguments)
        for bands in code.blocks():
            for start, A, hit, found in code.vertex(bands):
                R = code.bands("R", start)
                code.store(code.sum(code.product(A, code.sum(hit, code.load(R))), found), R)
        return target.get_dummy_value()

    return types.void(path, tables, types.intp, width), generate


@intrinsic(prefer_literal=True)
def collect(context: Any, path: Any, tables: Any, k: Any, width: Any, y: Any) -> Any:
    """At vertex k of a `LobePath` `y` gains A h L_b + B L_a in row 1 and A R in row 3; A is kept."""

    def generate(target: Any, builder: Any, called: Any, arguments: Any) -> Any:
        code = _Code(target, builder, called, arguments)
        light = target.make_array(called.args[4])(target, builder, arguments[4])
        for bands in code.blocks():
            for start, A, hit, found in code.vertex(bands):
                indirect = code.product(A, code.load(code.bands("R", start)))
                for row, gain in ((1, code.sum(code.product(A, hit), found)), (3, indirect)):
                    place = code.row(light.data, ir.Constant(_PLACE, row), start)
                    code.store(code.sum(code.load(place), gain), place)
        return target.get_dummy_value()

    return types.void(path, tables, types.intp, width, y), generate


@intrinsic(prefer_literal=True)
def colour(context: Any, out: Any, tables: Any, to: Any, width: Any, c0: Any, c1: Any, c2: Any) -> Any:
    """Put the sigmoid of (c_0 w + c_1) w + c_2 into row `to` of `out`."""

    def generate(target: Any, builder: Any, called: Any, arguments: Any) -> Any:
        code = _Code(target, builder, called, arguments)
        c0, c1, c2 = map(code.everywhere, arguments[4:])
        spectra = target.make_array(out)(target, builder, arguments[0])
        half, wavelengths = code.number(0.5), code.field(1, "wavelengths").data
        for start in range(0, code.width, LANES):
            w = code.load(builder.gep(wavelengths, [ir.Constant(_PLACE, start)]))
            x = code.sum(code.product(code.sum(code.product(c0, w), c1), w), c2)
            root = code.reciprocal_root(code.sum(code.product(x, x), code.number(1.0)))
            S = code.sum(code.product(code.product(half, x), root), half)
            code.store(S, code.row(spectra.data, arguments[2], start))
        return target.get_dummy_value()

    return types.void(out, tables, types.intp, width, *[types.float32] * 3), generate


class _Code:
    """Writes instructions. Arguments: a `LobePath` or an array, `LobeTables`, a number, and the number of bands."""

    def __init__(self, target: Any, builder: Any, called: Any, arguments: Any) -> None:
        self.target, self.builder, self.types, self.arguments = target, builder, called.args, arguments
        self.width = int(called.args[3].literal_value)

    def blocks(self) -> list[range]:
        """The first bands of registers, as many at a time as the processor has room for."""
        step = _BLOCK * LANES
        return [range(start, min(start + step, self.width), LANES) for start in range(0, self.width, step)]

    def field(self, argument: int, *names: str) -> Any:
        """An array in an argument that is a named tuple."""
        value, of = self.arguments[argument], self.types[argument]
        for name in names:
            at = of.fields.index(name)
            value, of = self.builder.extract_value(value, at), of.types[at]
        return self.target.make_array(of)(self.target, self.builder, value)

    def entry(self, name: str, at: Any) -> Any:
        """A number in an array of the path."""
        return self.builder.load(self.builder.gep(self.field(0, name).data, [at]))

    def bands(self, name: str, start: int) -> Any:
        return self.builder.gep(self.field(0, name).data, [ir.Constant(_PLACE, start)])

    def row(self, data: Any, row: Any, start: int) -> Any:
        place = self.builder.mul(row, ir.Constant(_PLACE, self.width))
        return self.builder.gep(data, [self.builder.add(place, ir.Constant(_PLACE, start))])

    def load(self, place: Any) -> Any:
        value = self.builder.load(self.builder.bitcast(place, _REGISTER.as_pointer()))
        value.align = 4
        return value

    def store(self, value: Any, place: Any) -> None:
        self.builder.store(value, self.builder.bitcast(place, _REGISTER.as_pointer())).align = 4

    def sum(self, a: Any, b: Any) -> Any:
        return self.builder.fadd(a, b, flags=_FLAGS)

    def product(self, a: Any, b: Any) -> Any:
        return self.builder.fmul(a, b, flags=_FLAGS)

    def number(self, value: float) -> Any:
        return ir.Constant(_REGISTER, [value] * LANES)

    def everywhere(self, number: Any) -> Any:
        nothing = ir.Constant(_REGISTER, ir.Undefined)
        one = self.builder.insert_element(nothing, number, ir.Constant(_INT, 0))
        return self.builder.shuffle_vector(one, nothing, ir.Constant(_INTEGERS, [0] * LANES))

    def spectrum(self, table: Any, rows: Any, row: Any, other: Any, other_row: Any) -> Callable[[int], Any]:
        """What loads bands of a row of a table, or, from `rows` on, of a row of another one."""
        inside = self.builder.icmp_signed("<", row, rows)
        data = self.builder.select(inside, table.data, other.data)
        place = self.builder.select(inside, row, other_row)
        return lambda start: self.load(self.row(data, place, start))

    def vertex(self, bands: range) -> list[tuple[int, Any, Any, Any]]:
        """Keep A of a vertex; return A, h L_b and B L_a of each register."""
        builder, k = self.builder, self.arguments[2]
        zero, one, two = (ir.Constant(_PLACE, n) for n in range(3))
        first, stop = self.entry("first", k), self.entry("first", builder.add(k, one))
        spectra, own = self.field(1, "spectra", "reflectance"), self.field(0, "own")
        rows = builder.extract_value(self.arguments[1], self.types[1].fields.index("rows"))
        sums = {name: [cgutils.alloca_once(builder, _REGISTER) for _ in bands] for name in ("sent", "found")}
        for total in (*sums["sent"], *sums["found"]):
            builder.store(self.number(0.0), total)
        with cgutils.for_range(builder, builder.sub(stop, first)) as loop:
            at = builder.add(first, loop.index)
            spectrum = self.spectrum(spectra, rows, self.entry("row", at), own, loop.index)
            c, d = (self.everywhere(self.entry(name, at)) for name in ("sent", "found"))
            for start, A, B in zip(bands, sums["sent"], sums["found"], strict=True):
                S = spectrum(start)
                builder.store(self.sum(builder.load(A), self.product(c, S)), A)
                builder.store(self.sum(builder.load(B), self.product(d, S)), B)
        lights, shining, at = (
            self.field(1, "spectra", "lights"),
            self.field(0, "shining"),
            builder.mul(two, k),
        )
        count = builder.extract_value(lights.shape, 0)
        found, hit = (
            self.spectrum(lights, count, self.entry("lights", builder.add(at, n)), shining, n)
            for n in (zero, one)
        )
        h = self.everywhere(self.entry("hit", k))
        out = []
        for start, *totals in zip(bands, sums["sent"], sums["found"], strict=True):
            A, B = map(builder.load, totals)
            self.store(A, self.bands("A", start))
            out.append((start, A, self.product(h, hit(start)), self.product(B, found(start))))
        return out

    def reciprocal_root(self, y: Any) -> Any:
        """1 / sqrt(y) to single precision, from the bits of y and three of Newton's steps."""
        builder = self.builder
        bits = builder.lshr(builder.bitcast(y, _INTEGERS), ir.Constant(_INTEGERS, [1] * LANES))
        guess = builder.sub(ir.Constant(_INTEGERS, [_MAGIC] * LANES), bits)
        root = builder.bitcast(guess, _REGISTER)
        less = self.product(self.number(-0.5), y)
        for _ in range(3):
            square = self.product(root, root)
            root = self.product(root, self.sum(self.number(1.5), self.product(less, square)))
        return root
