"""Sine, arc tangent, exponential and logarithm of arrays by sums, products and quotients: the same on every machine.

NumPy and the C library have several codes for each, chosen by the processor, whose last bits differ. Where positions
come of it, these are taken instead: the series of fdlibm [1]_, right to a unit or two in the last place.

References
----------
.. [1] Sun Microsystems, Freely distributable libm 5.3, 1993. https://netlib.org/fdlibm
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.model.arrays import FloatArray

#: A right angle in three parts, of which multiples by whole numbers are exact, or nearly.
_RIGHT: Final = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
_SINE: Final = (
    *(-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04),
    *(2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10),
)
_COSINE: Final = (
    *(4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05),
    *(-2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11),
)
_ARC: Final = (
    *(3.33333333333329318027e-01, -1.99999999998764832476e-01, 1.42857142725034663711e-01, -1.11111104054623557880e-01),
    *(9.09088713343650656196e-02, -7.69187620504482999495e-02, 6.66107313738753120669e-02, -5.83357013379057348645e-02),
    *(4.97687799461593236017e-02, -3.65315727442169155270e-02, 1.62858201153657823623e-02),
)
_EXPONENTIAL: Final = (
    *(1.66666666666666019037e-01, -2.77777777770155933842e-03, 6.61375632143793436117e-05),
    *(-1.65339022054652515390e-06, 4.13813679705723846039e-08),
)
#: Of the logarithm; compiled kernels use them as well.
LOGARITHM: Final = (
    *(6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01, 2.222219843214978396e-01),
    *(1.818357216161805012e-01, 1.531383769920937332e-01, 1.479819860511658591e-01),
)
#: Its multiples by small whole numbers are exact, with what is left of the logarithm of 2.
LOG_TWO: Final = (6.93147180369123816490e-01, 1.90821492927058770002e-10)
#: Tangent of an eighth of a turn's half.
_EIGHTH: Final = float(np.sqrt(2.0)) - 1.0


def _series(z: FloatArray, factors: tuple[float, ...]) -> FloatArray:
    total = np.full_like(z, factors[-1])
    for factor in factors[-2::-1]:
        total = total * z + factor
    return total


def sine_cosine(angle: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Sine and cosine of angles up to some thousand turns, radians."""
    x = np.asarray(angle, dtype=np.float64)
    quarter = np.rint(x / (_RIGHT[0] + _RIGHT[1]))
    y = ((x - quarter * _RIGHT[0]) - quarter * _RIGHT[1]) - quarter * _RIGHT[2]
    z = y * y
    sine = y + y * z * _series(z, _SINE)
    cosine = 1.0 - (0.5 * z - z * z * _series(z, _COSINE))
    turn = np.mod(quarter, 4.0)
    swapped = (turn == 1.0) | (turn == 3.0)
    one, two = np.where(swapped, cosine, sine), np.where(swapped, sine, cosine)
    return np.where(turn >= 2.0, -one, one), np.where((turn == 1.0) | (turn == 2.0), -two, two)


def arctan2(y: npt.ArrayLike, x: npt.ArrayLike) -> FloatArray:
    """Angle of points (x, y), -pi to pi radians; 0 at the origin."""
    up, along = np.broadcast_arrays(np.asarray(y, dtype=np.float64), np.asarray(x, dtype=np.float64))
    high, wide = np.abs(up), np.abs(along)
    steep = high > wide
    least, most = np.where(steep, wide, high), np.where(steep, high, wide)
    # Up to an eighth of a turn by the quotient; the angle is then seen from a sixteenth, where the series is short.
    slope = least / np.where(most > 0.0, most, 1.0)
    far = slope > _EIGHTH
    t = np.where(far, (slope - 1.0) / (slope + 1.0), slope)
    z = t * t
    angle = t - t * z * _series(z, _ARC)
    quarter = _RIGHT[0] + _RIGHT[1]
    angle = np.where(far, 0.5 * quarter + angle, angle)
    angle = np.where(steep, quarter - angle, angle)
    angle = np.where(along < 0.0, 2.0 * quarter - angle, angle)
    return np.asarray(np.where(up < 0.0, -angle, angle))


def exponential(x: npt.ArrayLike) -> FloatArray:
    """e to the power of numbers up to some hundred."""
    x = np.asarray(x, dtype=np.float64)
    two = np.rint(x / (LOG_TWO[0] + LOG_TWO[1]))
    high, low = x - two * LOG_TWO[0], two * LOG_TWO[1]
    rest = high - low
    z = rest * rest
    c = rest - z * _series(z, _EXPONENTIAL)
    return np.asarray(np.ldexp(1.0 - ((low - rest * c / (2.0 - c)) - high), two.astype(np.int64)))


def logarithm(x: npt.ArrayLike) -> FloatArray:
    """Natural logarithm of positive numbers."""
    share, two = np.frexp(np.asarray(x, dtype=np.float64))
    small = share < 0.5 * np.sqrt(2.0)
    share, two = np.where(small, 2.0 * share, share), np.where(small, two - 1, two).astype(np.float64)
    f = share - 1.0
    s = f / (2.0 + f)
    half = 0.5 * f * f
    z = s * s
    rest = z * _series(z, LOGARITHM)
    return np.asarray(two * LOG_TWO[0] - ((half - (s * (half + rest) + two * LOG_TWO[1])) - f))


def growth(x: npt.ArrayLike) -> FloatArray:
    """e to the power of numbers, less one: exact to the last digits for small ones too."""
    x = np.asarray(x, dtype=np.float64)
    whole = exponential(x)
    # The errors of both logarithm and exponential near 1 cancel (Kahan).
    rate = logarithm(np.where(whole > 0.0, whole, 1.0))
    return np.asarray(np.where(whole == 1.0, x, (whole - 1.0) * x / np.where(rate == 0.0, 1.0, rate)))
