# SPDX-License-Identifier: Apache-2.0
"""Dr.Jit's functions, and dual numbers they take as well: arrays that carry their derivatives along.

A formula that takes its functions from here (`from ..arrays import dual as dr`) is Dr.Jit's own as long as it is given
arrays, and gives derivatives by all directions in one go when it is given dual numbers (forward mode, R. E. Wengert, "A
Simple Automatic Derivative Evaluation Program", 1964). Dr.Jit 1.5.0 differentiates, too, but guards every product
against zero times infinity by a comparison and a selection, a third of the operations of a material
(`tests/material/arrays/test_dual.py`). Here a slope is selected along with its value, so what a mask leaves out needs
no guard.

Dr.Jit's arrays refuse other types on their right, so that all arrays of a formula have to be dual numbers if one is;
masks, numbers of Python and arrays on the right side of an operator need not.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit

Slopes = dict[int, Any]


class Dual:
    """A Dr.Jit array of floats, or a vector of them, with its slope along each direction it changes in."""

    __slots__ = ("slopes", "value")
    __hash__ = None  # type: ignore[assignment]  # `==` compares element by element

    def __init__(self, value: Any, slopes: Slopes | None = None) -> None:
        self.value = value
        self.slopes: Slopes = slopes or {}

    def __getitem__(self, index: int) -> Dual:
        return _mapped(lambda array: array[index], self)

    @property
    def x(self) -> Dual:
        """First component."""
        return self[0]

    @property
    def y(self) -> Dual:
        """Second component."""
        return self[1]

    @property
    def z(self) -> Dual:
        """Third component."""
        return self[2]

    def __neg__(self) -> Dual:
        return _mapped(lambda array: -array, self)

    def __add__(self, other: Any) -> Dual:
        return _sum(self.value + value_of(other), (self, _same), (other, _same))

    def __sub__(self, other: Any) -> Dual:
        return _sum(self.value - value_of(other), (self, _same), (other, _times(-1.0)))

    def __rsub__(self, other: Any) -> Dual:
        return _sum(other - self.value, (self, _times(-1.0)))

    def __mul__(self, other: Any) -> Dual:
        return _sum(self.value * value_of(other), (self, _times(value_of(other))), (other, _times(self.value)))

    def __truediv__(self, other: Any) -> Dual:
        value = self.value / value_of(other)
        if not isinstance(other, Dual):
            return _sum(value, (self, _times(1.0 / other)))
        scale = drjit.rcp(other.value)
        return _sum(value, (self, _times(scale)), (other, _times(-value * scale)))

    def __rtruediv__(self, other: Any) -> Dual:
        value = other / self.value
        return _sum(value, (self, _times(-value / self.value)))

    def __pow__(self, exponent: int) -> Dual:
        return _sum(self.value**exponent, (self, _times(exponent * self.value ** (exponent - 1))))

    __radd__, __rmul__ = __add__, __mul__

    def __lt__(self, other: Any) -> Any:
        return self.value < value_of(other)

    def __le__(self, other: Any) -> Any:
        return self.value <= value_of(other)

    def __gt__(self, other: Any) -> Any:
        return self.value > value_of(other)

    def __ge__(self, other: Any) -> Any:
        return self.value >= value_of(other)

    def __eq__(self, other: object) -> Any:
        return self.value == value_of(other)

    def __ne__(self, other: object) -> Any:
        return self.value != value_of(other)


def value_of(x: Any) -> Any:
    """What `x` is without its slopes."""
    return x.value if isinstance(x, Dual) else x


def array_type(x: Any) -> type:
    """The type of the array in `x`."""
    return type(value_of(x))


def kind_of(x: Any) -> Callable[..., Any]:
    """What makes numbers of the kind of `x`, arrays or dual numbers, from one number or from components."""
    return (lambda *components: _made(array_type(x), components)) if isinstance(x, Dual) else type(x)


def cast(array: type, *components: Any) -> Any:
    """An `array` from one number or from components; a dual number if one of these is."""
    return _made(array, components) if any(isinstance(c, Dual) for c in components) else array(*components)


def _made(array: type, components: tuple[Any, ...]) -> Dual:
    slopes: Slopes = {}
    for k in sorted({k for c in components if isinstance(c, Dual) for k in c.slopes}):
        slopes[k] = array(*(c.slopes.get(k, 0.0) if isinstance(c, Dual) else 0.0 for c in components))
    return Dual(array(*map(value_of, components)), slopes)


def _mapped(linear: Callable[[Any], Any], x: Dual) -> Dual:
    return Dual(linear(x.value), {k: linear(slope) for k, slope in x.slopes.items()})


def _sum(value: Any, *parts: tuple[Any, Callable[[Any], Any]]) -> Dual:
    """`value` with the sum of what the parts' linear functions make of their numbers' slopes."""
    slopes: Slopes = {}
    for x, linear in parts:
        for k, slope in x.slopes.items() if isinstance(x, Dual) else ():
            term = linear(slope)
            slopes[k] = slopes[k] + term if k in slopes else term
    return Dual(value, slopes)


def _same(slope: Any) -> Any:
    return slope


def _times(weight: Any) -> Callable[[Any], Any]:
    return lambda slope: weight * slope


def _by_slope(function: Callable[[Any], Any], weight: Callable[[Any, Any], Any], name: str) -> Callable[[Any], Any]:
    """`function` of arrays and, with the derivative `weight` (argument, value), of dual numbers."""

    def of_either(x: Any) -> Any:
        if not isinstance(x, Dual):
            return function(x)
        value = function(x.value)
        return _sum(value, (x, _times(weight(x.value, value))))

    of_either.__name__, of_either.__doc__ = name, f"`drjit.{name}`."
    return of_either


square = _by_slope(drjit.square, lambda x, _: x + x, "square")
sqrt = _by_slope(drjit.sqrt, lambda _, root: 0.5 / root, "sqrt")
safe_sqrt = _by_slope(drjit.safe_sqrt, lambda x, root: drjit.select(x > drjit.epsilon(x), 0.5 / root, 0.0), "safe_sqrt")
rsqrt = _by_slope(drjit.rsqrt, lambda x, inverse: -0.5 * inverse / x, "rsqrt")
rcp = _by_slope(drjit.rcp, lambda _, inverse: -drjit.square(inverse), "rcp")
exp = _by_slope(drjit.exp, lambda _, power: power, "exp")
log = _by_slope(drjit.log, lambda x, _: drjit.rcp(x), "log")
atan = _by_slope(drjit.atan, lambda x, _: drjit.rcp(1.0 + drjit.square(x)), "atan")
cos = _by_slope(drjit.cos, lambda x, _: -drjit.sin(x), "cos")
safe_acos = _by_slope(
    drjit.safe_acos, lambda x, _: -drjit.rsqrt(drjit.maximum(1.0 - drjit.square(x), drjit.epsilon(x))), "safe_acos"
)
abs = _by_slope(drjit.abs, lambda x, _: drjit.sign(x), "abs")


def sincos(x: Any) -> tuple[Any, Any]:
    """`drjit.sincos`."""
    sine, cosine = drjit.sincos(value_of(x))
    if not isinstance(x, Dual):
        return sine, cosine
    return _sum(sine, (x, _times(cosine))), _sum(cosine, (x, _times(-sine)))


def select(mask: Any, yes: Any, no: Any) -> Any:
    """`drjit.select`; a number that both sides are stays one, to which a dual number can be added."""
    if isinstance(yes, (int, float)) and isinstance(no, (int, float)) and yes == no:
        return yes
    value = drjit.select(mask, value_of(yes), value_of(no))
    if not (isinstance(yes, Dual) or isinstance(no, Dual)):
        return value
    slopes, others = (x.slopes if isinstance(x, Dual) else {} for x in (yes, no))
    return Dual(value, {k: drjit.select(mask, slopes.get(k, 0.0), others.get(k, 0.0)) for k in {**slopes, **others}})


def maximum(a: Any, b: Any) -> Any:
    """`drjit.maximum`; between equal numbers the slope is that of `b`."""
    if not (isinstance(a, Dual) or isinstance(b, Dual)):
        return drjit.maximum(a, b)
    return Dual(drjit.maximum(value_of(a), value_of(b)), select(value_of(a) > value_of(b), a, b).slopes)


def minimum(a: Any, b: Any) -> Any:
    """`drjit.minimum`; between equal numbers the slope is that of `a`."""
    if not (isinstance(a, Dual) or isinstance(b, Dual)):
        return drjit.minimum(a, b)
    return Dual(drjit.minimum(value_of(a), value_of(b)), select(value_of(a) <= value_of(b), a, b).slopes)


def clip(x: Any, lower: Any, upper: Any) -> Any:
    """`drjit.clip`."""
    return maximum(minimum(x, upper), lower) if isinstance(x, Dual) else drjit.clip(x, lower, upper)


def lerp(a: Any, b: Any, t: Any) -> Any:
    """`drjit.lerp`."""
    va, vb, vt = map(value_of, (a, b, t))
    value = drjit.lerp(va, vb, vt)
    if not any(isinstance(x, Dual) for x in (a, b, t)):
        return value
    return _sum(value, (a, _times(1.0 - vt)), (b, _times(vt)), (t, _times(vb - va)))


def mulsign(x: Any, sign: Any) -> Any:
    """`drjit.mulsign`; the sign has no slope."""
    if not isinstance(x, Dual):
        return drjit.mulsign(x, value_of(sign))
    return _mapped(lambda array: drjit.mulsign(array, value_of(sign)), x)


def dot(a: Any, b: Any) -> Any:
    """`drjit.dot`."""
    if not (isinstance(a, Dual) or isinstance(b, Dual)):
        return drjit.dot(a, b)
    va, vb = value_of(a), value_of(b)
    return _sum(drjit.dot(va, vb), (a, lambda slope: drjit.dot(slope, vb)), (b, lambda slope: drjit.dot(va, slope)))


def normalize(v: Any) -> Any:
    """`drjit.normalize`."""
    if not isinstance(v, Dual):
        return drjit.normalize(v)
    direction = drjit.normalize(v.value)
    scale = drjit.rsqrt(drjit.squared_norm(v.value))
    return _sum(direction, (v, lambda slope: scale * (slope - direction * drjit.dot(direction, slope))))


def luminance(colour: Any) -> Any:
    """`mitsuba.luminance` of a linear Rec.709 colour."""
    import mitsuba

    return _mapped(mitsuba.luminance, colour) if isinstance(colour, Dual) else mitsuba.luminance(colour)


def varies(x: Any) -> bool:
    """Whether `x` has slopes, or Dr.Jit differentiates it."""
    return bool(x.slopes) if isinstance(x, Dual) else drjit.grad_enabled(x)


def detach(x: Any) -> Any:
    """`drjit.detach`; a dual number without its slopes."""
    return x.value if isinstance(x, Dual) else drjit.detach(x)


def is_array_v(x: Any) -> bool:
    """`drjit.is_array_v`; dual numbers hold arrays."""
    return isinstance(x, Dual) or drjit.is_array_v(x)


def __getattr__(name: str) -> Any:
    """Everything else is Dr.Jit's own and takes no dual numbers."""
    return getattr(drjit, name)
