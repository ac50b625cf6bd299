"""One-point quadrilateral shell of three layers with two convected fibre directions: pure functions.

Kinematics of Belytschko, Lin & Tsay (1984): bilinear mid-surface, one director a corner, one point, hourglass control
after Flanagan & Belytschko (1981). The strains are total, not integrated rates: the one-point deformation gradient maps
the diagonals of the quadrilateral exactly, so a fibre a0 = alpha X31 + beta X42 of the undeformed element is
a = alpha x31 + beta x42 now, and its rate of change through the thickness a' = alpha d31 + beta d42 with directors d.
The fibres are the co-rotational frame. Every term of the energy depends on scalar products of such vectors only, hence
rigid motions cost nothing, forces are the exact gradient, and energies have a closed form.

A corner's turn about the normal is held to that of the fibres by an energy of its own (drilling, after Hughes & Brezzi,
1989), which no stretch and no trellis shear feels.

Transverse shear is sampled along line segments, as in the element of Bathe & Dvorkin (1985), which makes it vanish in
constant curvature on any mesh. Notation: a warp, b weft; per reference area [mJ/mm^2] and per reference width [N/mm].
"""

from math import sqrt

from numba import njit

from knittest.kernels.vec import INLINE, add, combine, cross, dot, scale, sub

HALF_PI = 1.5707963267948966
#: floor of cos^2(shear angle), where the fibres of a crushed or dead element fall on each other
COLLAPSED = 1e-12


@njit(**INLINE)
def arcsine(s):
    """Arc sine [rad] of s in [-1, 1] without branches, so that it vectorises; the rational fit of fdlibm (1993)."""
    size = min(abs(s), 1.0)
    outer = size > 0.5
    t = 0.5 * (1.0 - size) if outer else size * size
    x = sqrt(t)
    top = 7.91534994289814532176e-04 + t * 3.47933107596021167570e-05
    top = -3.25565818622400915405e-01 + t * (2.01212532134862925881e-01 + t * (-4.00555345006794114027e-02 + t * top))
    top = t * (1.66666666666666657415e-01 + t * top)
    low = 2.02094576023350569471e00 + t * (-6.88283971605453293030e-01 + t * 7.70381505559019352791e-02)
    low = 1.0 + t * (-2.40339491173441421878e00 + t * low)
    value = x + x * top / low
    value = HALF_PI - 2.0 * value if outer else value
    return value if s >= 0.0 else -value


@njit(**INLINE)
def diagonals(p):
    """Diagonals p3 - p1 and p4 - p2 of four positions [mm] or directors [-]."""
    return sub(p[2], p[0]), sub(p[3], p[1])


@njit(**INLINE)
def fibre_vectors(p, fibres):
    """Fibre vectors a, b [-] of corners ``p`` [mm], or their rates through the thickness [1/mm] of directors ``p`` [-].

    ``fibres`` (alpha_a, beta_a, alpha_b, beta_b) [1/mm].
    """
    p31, p42 = diagonals(p)
    return combine(fibres[0], p31, fibres[1], p42), combine(fibres[2], p31, fibres[3], p42)


@njit(**INLINE)
def fibre_frame(x, d, fibres):
    """Fibre vectors a, b [-] and their rates through the thickness a', b' [1/mm].

    Corners ``x`` [mm], directors ``d`` [-], ``fibres`` (alpha_a, beta_a, alpha_b, beta_b) [1/mm].
    """
    a, b = fibre_vectors(x, fibres)
    a_z, b_z = fibre_vectors(d, fibres)
    return a, b, a_z, b_z


@njit(**INLINE)
def fibre_pair(a, b):
    """Inverse lengths of the fibre vectors and the sine of the shear angle (pi/2 less the angle between them)."""
    inv_a, inv_b = 1.0 / sqrt(dot(a, a)), 1.0 / sqrt(dot(b, b))
    return inv_a, inv_b, dot(a, b) * inv_a * inv_b


@njit(**INLINE)
def fibre_strain(fibre, inv_length):
    """Engineering strain of a fibre, stretch less one [-]."""
    return dot(fibre, fibre) * inv_length - 1.0


@njit(**INLINE)
def layers(strain, bend, middle, outer, layer_offset):
    """Membrane force [N/mm] and moment [N] per width of three layers at -layer_offset, 0, +layer_offset [mm].

    ``middle`` is the force of the middle layer [N/mm], ``outer`` the stiffness E t of each outer layer [N/mm].
    """
    low, high = outer * (strain - layer_offset * bend), outer * (strain + layer_offset * bend)
    return low + middle + high, layer_offset * (high - low)


@njit(**INLINE)
def layers_energies(strain, bend, middle, outer, layer_offset):
    """Energies per area [mJ/mm^2] of :func:`layers`, of stretching and of bending; ``middle`` is that of the middle
    layer.
    """
    lever = layer_offset * bend
    return middle + outer * strain * strain, outer * lever * lever


@njit(**INLINE)
def laminate_gradients(frame, area, strains, middle, shear_force, stiffness):
    """Gradients of area times the laminate's energy with respect to a, b, a', b'.

    Fibre strains and forces of the middle layer [N/mm] in warp and weft, S(gamma) [N/mm],
    ``stiffness`` (layer_offset, outer warp, outer weft, twist). With |a| = 1 / inv_a, cos gamma d gamma/da =
    (b/|b| - sin gamma a/|a|) / |a|, and d kappa_a/da = (a' - kappa_a a/|a|) / |a| for the bend kappa_a = a . a' / |a|.
    """
    a, b, a_z, b_z = frame
    layer_offset, outer_a, outer_b, twist = stiffness
    inv_a, inv_b, sine = fibre_pair(a, b)
    bend_a, bend_b = dot(a, a_z) * inv_a, dot(b, b_z) * inv_b
    force_a, moment_a = layers(strains[0], bend_a, middle[0], outer_a, layer_offset)
    force_b, moment_b = layers(strains[1], bend_b, middle[1], outer_b, layer_offset)
    shear = shear_force / sqrt(max(1.0 - sine * sine, COLLAPSED))
    own_a = area * inv_a * (force_a - (moment_a * bend_a + shear * sine) * inv_a)
    own_b = area * inv_b * (force_b - (moment_b * bend_b + shear * sine) * inv_b)
    mixed = area * shear * inv_a * inv_b
    moment_a, moment_b = area * inv_a * moment_a, area * inv_b * moment_b
    torque = area * twist * (dot(a, b_z) + dot(b, a_z))
    grad_a = add(combine(own_a, a, mixed, b), combine(moment_a, a_z, torque, b_z))
    grad_b = add(combine(own_b, b, mixed, a), combine(moment_b, b_z, torque, a_z))
    return grad_a, grad_b, combine(moment_a, a, torque, b), combine(moment_b, b, torque, a)


@njit(**INLINE)
def coupling_gradients(frame, stiffness):
    """Gradients of ``stiffness`` kappa_a kappa_b [mJ] with respect to a, b, a', b'; bends as in the laminate."""
    a, b, a_z, b_z = frame
    inv_a, inv_b, _ = fibre_pair(a, b)
    bend_a, bend_b = dot(a, a_z) * inv_a, dot(b, b_z) * inv_b
    on_a, on_b = stiffness * bend_b * inv_a, stiffness * bend_a * inv_b
    grad_a = combine(on_a, a_z, -on_a * bend_a * inv_a, a)
    grad_b = combine(on_b, b_z, -on_b * bend_b * inv_b, b)
    return grad_a, grad_b, scale(on_a, a), scale(on_b, b)


@njit(**INLINE)
def hourglass(p, distortion):
    """Part of the pattern p1 - p2 + p3 - p4 that no linear field causes; ``distortion`` is that of the element."""
    p31, p42 = diagonals(p)
    return sub(sub(add(p[0], p[2]), add(p[1], p[3])), combine(distortion[0], p31, distortion[1], p42))


@njit(**INLINE)
def hourglass_gradients(frame, pattern, stiffness):
    """Gradients of (k_a (p . a)^2 + k_b (p . b)^2) / 2, k the ``stiffness``, with respect to the pattern p, a and b."""
    along, across = stiffness[0] * dot(pattern, frame[0]), stiffness[1] * dot(pattern, frame[1])
    return combine(along, frame[0], across, frame[1]), scale(along, pattern), scale(across, pattern)


@njit(**INLINE)
def hourglass_energy(frame, pattern, stiffness):
    """Energy [mJ] of :func:`hourglass_gradients`."""
    return 0.5 * (stiffness[0] * dot(pattern, frame[0]) ** 2 + stiffness[1] * dot(pattern, frame[1]) ** 2)


@njit(**INLINE)
def drill(a, b, warp, director):
    """Turn of a corner about its normal against the fibres [rad], and the corner's weft.

    ``warp`` is the initial warp as the corner has turned it, R a0, and its weft R b0 = d x R a0. The turn
    (b . R a0 - a . R b0) / 2 vanishes for F = R U whatever the stretch U, trellis shear included.
    """
    weft = cross(director, warp)
    return 0.5 * (dot(b, warp) - dot(a, weft)), weft


@njit(**INLINE)
def drill_gradients(a, b, warp, director, stiffness):
    """Gradients of stiffness turn^2 / 2 of :func:`drill` with respect to a and b, and the corner's moment."""
    turn, weft = drill(a, b, warp, director)
    pull = 0.5 * stiffness * turn
    return scale(-pull, weft), scale(pull, warp), scale(pull, sub(cross(b, warp), cross(a, weft)))


@njit(**INLINE)
def spread(grad_a, grad_b, pattern, fibres, distortion):
    """Gradients at the four corners from those of the two fibre vectors and of the hourglass pattern."""
    g31 = sub(combine(fibres[0], grad_a, fibres[2], grad_b), scale(distortion[0], pattern))
    g42 = sub(combine(fibres[1], grad_a, fibres[3], grad_b), scale(distortion[1], pattern))
    return sub(pattern, g31), scale(-1.0, add(pattern, g42)), add(pattern, g31), sub(g42, pattern)


@njit(**INLINE)
def line_shear(x1, x2, d1, d2):
    """Transverse shear times length along the segment from corner 1 to 2 [mm]; zero in constant curvature."""
    return 0.5 * dot(sub(x2, x1), add(d1, d2))


@njit(**INLINE)
def transverse_shears(x, d, fibres, warp):
    """Transverse shear of warp and weft fibre [-], and its two linear parts from opposite edges [mm].

    ``warp`` is the initial out-of-plane pattern of the element [mm], which is excluded.
    """
    x1, x2, x3, x4 = x
    d1, d2, d3, d4 = d
    s31, s42 = line_shear(x1, x3, d1, d3), line_shear(x2, x4, d2, d4)
    along = line_shear(x1, x2, d1, d2) + line_shear(x3, x4, d3, d4) + warp
    across = line_shear(x2, x3, d2, d3) + line_shear(x4, x1, d4, d1) - warp
    return fibres[0] * s31 + fibres[1] * s42, fibres[2] * s31 + fibres[3] * s42, along, across


@njit(**INLINE)
def transverse_gradients(x, d, fibres, forces):
    """Gradients of the transverse energy at corners and directors, (4, 3) each, from its four ``forces`` [N mm], [N].

    ``forces`` are conjugate to :func:`transverse_shears`; a tension T along the segment i-j gives
    +- T (d_i + d_j) / 2 at its ends and T (x_j - x_i) / 2 at both directors.
    """
    t31 = 0.5 * (fibres[0] * forces[0] + fibres[2] * forces[1])
    t42 = 0.5 * (fibres[1] * forces[0] + fibres[3] * forces[1])
    along, across = 0.5 * forces[2], 0.5 * forces[3]
    p31, p42 = scale(t31, add(d[0], d[2])), scale(t42, add(d[1], d[3]))
    p12, p34 = scale(along, add(d[0], d[1])), scale(along, add(d[2], d[3]))
    p23, p41 = scale(across, add(d[1], d[2])), scale(across, add(d[3], d[0]))
    f1, f2 = sub(sub(p41, p12), p31), sub(sub(p12, p23), p42)
    f3, f4 = add(sub(p23, p34), p31), add(sub(p34, p41), p42)
    x31, x42 = diagonals(x)
    r31, r42 = scale(t31, x31), scale(t42, x42)
    r12, r34 = scale(along, sub(x[1], x[0])), scale(along, sub(x[3], x[2]))
    r23, r41 = scale(across, sub(x[2], x[1])), scale(across, sub(x[0], x[3]))
    g1, g2 = add(add(r41, r12), r31), add(add(r12, r23), r42)
    g3, g4 = add(add(r23, r34), r31), add(add(r34, r41), r42)
    return (f1, f2, f3, f4), (g1, g2, g3, g4)


@njit(**INLINE)
def moment_of(gradient, director):
    """Nodal moment [N mm] from the energy gradient with respect to the director: -d x g."""
    return cross(gradient, director)
