"""Elementary functions of packs: sine and cosine, arc tangent.

Source: Moshier (1992), Methods and Programs for Mathematical Functions (the Cephes library), for the
coefficients. Errors are below two units in the last place.
"""

from taskopt.jit import kernel
from taskopt.jit.pack import nearest, size, where_less

_TURN = 0.63661977236758134308  # 2/π
_QUARTER = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21)  # π/2 = their sum
_SIN = (
    1.58962301576546568060e-10, -2.50507477628578072866e-8, 2.75573136213857245213e-6,
    -1.98412698295895385996e-4, 8.33333333332211858878e-3, -1.66666666666666307295e-1,
)  # fmt: skip
_COS = (
    -1.13585365213876817300e-11, 2.08757008419747316778e-9, -2.75573141792967388112e-7,
    2.48015872888517045348e-5, -1.38888888888730564116e-3, 4.16666666666665929218e-2,
)  # fmt: skip
_ATAN_P = (
    -8.750608600031904122785e-1, -1.615753718733365076637e1, -7.500855792314704667340e1,
    -1.228866684490136173410e2, -6.485021904942025371773e1,
)  # fmt: skip
_ATAN_Q = (
    2.485846490142306297962e1, 1.650270098316988542046e2, 4.328810604912902668951e2,
    4.853903996359136964868e2, 1.945506571482613964425e2,
)  # fmt: skip
_EIGHTH = 0.78539816339744830962  # π/4
_EIGHTH_REST = 3.061616997868382943065e-17  # π/4 − _EIGHTH
LARGEST_ANGLE = 1e5  # [rad] beyond which π/2 in three parts is not exact enough


@kernel
def sine_cosine(x):
    """Compute sine and cosine.

    Args:
        x: Angles [rad], of magnitudes up to LARGEST_ANGLE.

    Returns:
        Sines and cosines, two packs.
    """
    turns = nearest(x * _TURN)
    y = ((x - turns * _QUARTER[0]) - turns * _QUARTER[1]) - turns * _QUARTER[2]
    z = y * y
    s, c = z * _SIN[0] + _SIN[1], z * _COS[0] + _COS[1]
    for k in range(2, 6):
        s, c = s * z + _SIN[k], c * z + _COS[k]
    s, c = y + y * (z * s), (1.0 - 0.5 * z) + (z * z) * c
    quarter = turns - 4.0 * nearest(turns * 0.25 - 0.375)  # 0, 1, 2 or 3
    odd = quarter - 2.0 * nearest(quarter * 0.5 - 0.25)
    s, c = where_less(0.5, odd, c, s), where_less(0.5, odd, s, c)
    return where_less(1.5, quarter, -s, s), where_less(size(quarter - 1.5), 1.0, -c, c)


@kernel
def angle_of(s, c):
    """Compute the angle whose sine and cosine are s and c up to a common factor, in [0, π/2].

    Args:
        s: Pack, not negative.
        c: Pack, not negative, and not zero where s is.

    Returns:
        The angles [rad].
    """
    swapped = where_less(c, s, 1.0 + 0.0 * s, 0.0 * s)
    tangent = where_less(c, s, c, s) / where_less(c, s, s, c)  # in [0, 1]
    large = where_less(0.66, tangent, 1.0 + 0.0 * s, 0.0 * s)
    t = where_less(0.5, large, (tangent - 1.0) / (tangent + 1.0), tangent)
    z = t * t
    p, q = z * _ATAN_P[0] + _ATAN_P[1], z + _ATAN_Q[0]
    for k in range(2, 5):
        p = p * z + _ATAN_P[k]
    for k in range(1, 5):
        q = q * z + _ATAN_Q[k]
    angle = large * _EIGHTH + (t * (z * p / q) + t + large * _EIGHTH_REST)
    return where_less(0.5, swapped, 2.0 * _EIGHTH - (angle - 2.0 * _EIGHTH_REST), angle)
