"""Law of two strains: membrane forces as the gradient of one energy per area, W(warp strain, weft strain).

W is a tensor product of uniform cubic B-splines on the range of a table. Beyond its highest strains and in compression
it goes on from the nearest point p of the table, with d the strain less p:

    W(p) + W_a c_a + W_b c_b + W_ab c_a c_b + (k_a d_a^2 + k_b d_b^2) / 2,    c = d.

Beyond the table k is a stated tangent. A direction slackens where its force would be negative, below the strain g to
which the pull of the other one contracts it. There p follows g, k is the stiffness in compression, and
c = d / (1 - d / s) with a small s: W_b at p is 0 but for the error of g, which does not grow with the slack. Below
zero in both directions W is the quadratic form at rest times the same share. All parts meet with equal forces, whatever
g is.
"""

import numpy as np
from numba import njit

from knittest.kernels.vec import ALLOCATING, INLINE

#: rows of ``energy_range`` of a direction: lowest and highest strain [-], spline cells per strain, tangent beyond the
#: table, stiffness in compression [N/mm]
LOW, HIGH, PER_STRAIN, BEYOND, PUSHED = range(5)
#: slack up to which the error of g counts, over the highest strain
FADING = 0.01


@njit(**INLINE)
def spline_cell(x, per_strain, cells):
    """Cell of a uniform spline and the place in it, 0 to 1, at ``x`` from its start."""
    at = x * per_strain
    i = min(int(at), cells - 1)
    return i, at - i


@njit(**INLINE)
def basis(t):
    """The four cubic B-splines of a cell at ``t``, with their first and second derivatives."""
    u = 1.0 - t
    value = (u * u * u / 6.0, (4.0 + 3.0 * t * t * (t - 2.0)) / 6.0, (4.0 + 3.0 * u * u * (u - 2.0)) / 6.0, t**3 / 6.0)
    slope = (-0.5 * u * u, 0.5 * t * (3.0 * t - 4.0), 0.5 * u * (4.0 - 3.0 * u), 0.5 * t * t)
    return value, slope, (u, 3.0 * t - 2.0, 1.0 - 3.0 * t, t)


@njit(**INLINE)
def _row(energy, i, j, weights):
    """Sums of four control values along the second direction with three sets of weights."""
    c0, c1, c2, c3 = energy[i, j], energy[i, j + 1], energy[i, j + 2], energy[i, j + 3]
    v, s, b = weights
    return (
        v[0] * c0 + v[1] * c1 + v[2] * c2 + v[3] * c3, s[0] * c0 + s[1] * c1 + s[2] * c2 + s[3] * c3,
        b[0] * c0 + b[1] * c1 + b[2] * c2 + b[3] * c3,
    )  # fmt: skip


@njit(**INLINE)
def _sum(w, r0, r1, r2, r3, k):
    return w[0] * r0[k] + w[1] * r1[k] + w[2] * r2[k] + w[3] * r3[k]


@njit(**INLINE)
def table_energy(law, a, b):
    """W and its derivatives W_a, W_b, W_aa, W_ab, W_bb [N/mm] at strains inside the table."""
    energy, of = law.energy, law.energy_range
    i, s = spline_cell(a - of[0, LOW], of[0, PER_STRAIN], energy.shape[0] - 3)
    j, t = spline_cell(b - of[1, LOW], of[1, PER_STRAIN], energy.shape[1] - 3)
    v, d, dd = basis(s)
    across = basis(t)
    r0, r1 = _row(energy, i, j, across), _row(energy, i + 1, j, across)
    r2, r3 = _row(energy, i + 2, j, across), _row(energy, i + 3, j, across)
    m, n = of[0, PER_STRAIN], of[1, PER_STRAIN]
    return (
        _sum(v, r0, r1, r2, r3, 0), m * _sum(d, r0, r1, r2, r3, 0), n * _sum(v, r0, r1, r2, r3, 1),
        m * m * _sum(dd, r0, r1, r2, r3, 0), m * n * _sum(d, r0, r1, r2, r3, 1), n * n * _sum(v, r0, r1, r2, r3, 2),
    )  # fmt: skip


@njit(**INLINE)
def contracted(law, direction, pull):
    """Strain of the other direction that carries no force while ``direction`` is strained by ``pull``; its slope."""
    high, cells = law.energy_range[direction, HIGH], law.contraction.shape[1] - 3
    i, t = spline_cell(pull, cells / high, cells)
    v, d, _ = basis(t)
    c0, c1 = law.contraction[direction, i], law.contraction[direction, i + 1]
    c2, c3 = law.contraction[direction, i + 2], law.contraction[direction, i + 3]
    slope = (d[0] * c0 + d[1] * c1 + d[2] * c2 + d[3] * c3) * cells / high
    return v[0] * c0 + v[1] * c1 + v[2] * c2 + v[3] * c3, slope


@njit(**INLINE)
def _fading(d, limit):
    """Way ``d`` < 0 that fades to ``limit``, and its derivative."""
    share = 1.0 / (1.0 - d / limit)
    return d * share, share * share


@njit(**INLINE)
def _nearest(law, a, b):
    """Nearest point of the table, distances to it, tangents there; ways that fade with their derivatives; slopes of the
    point of one direction over the strain of the other.
    """
    of = law.energy_range
    pull_a, pull_b = (a if a > 0.0 else 0.0), (b if b > 0.0 else 0.0)  # 0 where not a number
    pull_a, pull_b = min(pull_a, of[0, HIGH]), min(pull_b, of[1, HIGH])
    slack_b, slope_b = contracted(law, 0, pull_a)
    slack_a, slope_a = contracted(law, 1, pull_b)
    tangents = of[0, BEYOND], of[1, BEYOND]
    if a > 0.0 and b < slack_b:
        d_a, d_b = a - pull_a, b - slack_b
        way, fade = _fading(d_b, FADING * of[1, HIGH])
        slope = slope_b if d_a <= 0.0 else 0.0
        return (pull_a, slack_b), (d_a, d_b), (tangents[0], of[1, PUSHED]), (d_a, way), (1.0, fade), (0.0, slope)
    if b > 0.0 and a < slack_a:
        d_a, d_b = a - slack_a, b - pull_b
        way, fade = _fading(d_a, FADING * of[0, HIGH])
        slope = slope_a if d_b <= 0.0 else 0.0
        return (slack_a, pull_b), (d_a, d_b), (of[0, PUSHED], tangents[1]), (way, d_b), (fade, 1.0), (slope, 0.0)
    near_a, near_b = (a if a > of[0, LOW] else of[0, LOW]), (b if b > of[1, LOW] else of[1, LOW])
    near_a, near_b = min(near_a, of[0, HIGH]), min(near_b, of[1, HIGH])
    d = a - near_a, b - near_b
    return (near_a, near_b), d, tangents, d, (1.0, 1.0), (0.0, 0.0)


@njit(**INLINE)
def biaxial_forces(law, a, b):
    """Forces per width [N/mm] of warp and weft at their strains [-]."""
    if a <= 0.0 and b <= 0.0:
        mixed = law.compression_coupling
        return law.energy_range[0, PUSHED] * a + mixed * b, law.energy_range[1, PUSHED] * b + mixed * a
    p, d, k, c, fade, slope = _nearest(law, a, b)
    _, w_a, w_b, w_aa, w_ab, w_bb = table_energy(law, p[0], p[1])
    slack_a = slope[0] * (w_a * (1.0 - fade[0]) + w_aa * c[0] - k[0] * d[0])
    slack_b = slope[1] * (w_b * (1.0 - fade[1]) + w_bb * c[1] - k[1] * d[1])
    return (
        (w_a + w_ab * c[1]) * fade[0] + k[0] * d[0] + slack_b,
        (w_b + w_ab * c[0]) * fade[1] + k[1] * d[1] + slack_a,
    )


@njit(**INLINE)
def biaxial_energy(law, a, b):
    """Energy per area [N/mm] whose gradient is :func:`biaxial_forces`."""
    if a <= 0.0 and b <= 0.0:
        of = law.energy_range
        return 0.5 * (of[0, PUSHED] * a * a + of[1, PUSHED] * b * b) + law.compression_coupling * a * b
    p, d, k, c, _, _ = _nearest(law, a, b)
    w, w_a, w_b, _, w_ab, _ = table_energy(law, p[0], p[1])
    return w + w_a * c[0] + w_b * c[1] + w_ab * c[0] * c[1] + 0.5 * (k[0] * d[0] * d[0] + k[1] * d[1] * d[1])


@njit(**ALLOCATING)
def sample_law(strain, law):
    """Force of warp and weft, and energy, [N/mm], at each of the strains (n, 2): (n, 3)."""
    found = np.zeros((len(strain), 3))
    for k in range(len(strain)):
        found[k, 0], found[k, 1] = biaxial_forces(law, strain[k, 0], strain[k, 1])
        found[k, 2] = biaxial_energy(law, strain[k, 0], strain[k, 1])
    return found


@njit(**ALLOCATING)
def sample_table(strain, law):
    """Derivatives W_a, W_b, W_aa, W_ab, W_bb [N/mm] of the spline at each of the strains (n, 2) in it: (n, 5)."""
    found = np.zeros((len(strain), 5))
    for k in range(len(strain)):
        derivatives = table_energy(law, strain[k, 0], strain[k, 1])
        for i in range(5):
            found[k, i] = derivatives[i + 1]
    return found
