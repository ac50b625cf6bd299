"""Arrays of the explicit solver as NamedTuples, the form in which Numba takes them: nodes, elements, contacts, loads,
rigid tools, periodic images.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knittest.base.arrays import Array, Index


class Nodes(NamedTuple):
    """Node state, structure of arrays; the last column is padding for element n - 1.

    position [mm], rotation from the start as unit quaternion (w, x, y, z), velocity [mm/ms], spin (global angular
    velocity) [rad/ms], force [N] and moment [N mm] sums of the last step (on yarns moments of contacts alone): (3 or 4,
    n_nodes + 1); inverse mass [1/g] and inverse rotary inertia [1/(g mm^2)], 0 for clamped nodes: (n_nodes + 1,).
    ``damping_factor`` (n_nodes + 1,) is the share of velocity that mass-proportional damping leaves in a step.
    """

    position: Array
    rotation: Array
    velocity: Array
    spin: Array
    force: Array
    moment: Array
    inv_mass: Array
    inv_inertia: Array
    damping_factor: Array


class Partitions(NamedTuple):
    """Fixed partitions of the nodes, cut at chain ends: partition p owns nodes node[p] to node[p + 1].

    ``span`` (n_spans, 3) holds (first node, stop node, beam section), partition p owns spans span_start[p] to
    span_start[p + 1]; section -1 means nodes without beams.
    """

    node: Index
    span_start: Index
    span: Index


class Beams(NamedTuple):
    """One slot a node: element i joins nodes i and i + 1; chain ends and failed elements have alive = 0.

    Initial unit ``tangent`` (3, n_nodes); inverse rest length [1/mm], alive, strain at failure [-], slack strain [-]
    below which the law carries nothing, time of failure [ms] (inf while alive, nan for chain ends), all (n_nodes,).
    ``stiffness`` (n_sections, 4): compressive EA, GA [N], GJ, EI [N mm^2]. Axial law as hinge tables, (n_sections,
    n_hinges): N(e) = compression min(e, 0) + sum_k slope[k] max(e - slack - strain[k], 0). ``excess`` (n_sections,):
    EI about the initial unit ``normal`` (3, n_nodes) less the other [N mm^2], 0 for round sections.
    """

    tangent: Array
    inv_length: Array
    alive: Array
    fail_strain: Array
    slack: Array
    fail_time: Array
    stiffness: Array
    hinge_strain: Array
    hinge_slope: Array
    excess: Array
    normal: Array


class Contacts(NamedTuple):
    """Tracked yarn crossings in the first ``count`` columns.

    ``piece`` (2, n) spline pieces i, j (node index of the middle control point) with ``parameter`` s, t in [0, 1);
    tangential ``spring`` stretch and ``offset`` vector of the last step [mm], (3, n); ``slipping`` 1 while the contact
    slips; ``reach`` sum of radii [mm], ``arm`` the share of piece i, at which part of the offset the yarns touch;
    ``line`` its kind, by which s or t may be held, see :mod:`knittest.kernels.contact`; ``force`` on piece i [N],
    (3, n). ``twist`` [rad] of piece i over j about the offset in the spring that resists it, ``couple`` its moment over
    the length of the offset [N], ``lever`` (2, n) of its limit: coefficient [mm / N^p] and largest value [mm].
    ``half``: contact number and side (2 c + side) sorted by the partition that owns the side, half_start
    (PARTITIONS + 1,). ``share`` (n,) of its energies that counts: 1, in a periodic cell less for those that are, or
    have, an image. ``tangent`` of piece i and ``other_tangent`` of j in the last step [mm] by the parameter, (3, n).

    Where a section is an ellipse (:mod:`knittest.kernels.section`; else these have no columns), ``offset`` is that
    of the centres of their curvature: ``shift`` of these on piece i and ``other`` on j (3, n) [mm], ``touch`` (n,) sum
    of their radii [mm], 0 between circles. Of the nodes: ``upright`` (3, n_nodes) heights of the sections before they
    turn, ``turned`` now, ``square`` and ``excess`` (n_nodes,) [mm^2], and where they flatten ``shape`` (ROWS, n_nodes),
    see :mod:`knittest.kernels.flattening`. ``accepted`` (n,) overlap of the start [mm], which carries no force.
    """

    piece: Index
    parameter: Array
    spring: Array
    offset: Array
    slipping: Array
    reach: Array
    arm: Array
    line: Array
    force: Array
    twist: Array
    couple: Array
    lever: Array
    half: Index
    half_start: Index
    share: Array
    tangent: Array
    other_tangent: Array
    accepted: Array
    shift: Array = np.zeros((3, 0))
    other: Array = np.zeros((3, 0))
    touch: Array = np.zeros(0)
    upright: Array = np.zeros((3, 0))
    turned: Array = np.zeros((3, 0))
    square: Array = np.zeros(0)
    excess: Array = np.zeros(0)
    shape: Array = np.zeros((10, 0))


class ContactLaw(NamedTuple):
    """Penalty and friction of all yarn contacts.

    Penalty stiffness [N/mm], sticking stiffness [N/mm], Coulomb coefficients before and while slipping, viscous
    coefficient [N ms/mm]; compaction by ``linear``, ``square`` and ``cubic`` [1/mm, 1/mm^2, 1/mm^3] up to the depth
    ``cap`` [mm], see :func:`knittest.kernels.contact.penalty`; stiffness ``torsional`` [N mm/rad] against spin about
    the normal (0: none) and ``softening`` of the patch (0: its
    size is given), see :func:`knittest.kernels.spin.lever_of`.
    """

    normal: float
    tangential: float
    static: float
    kinetic: float
    viscous: float
    linear: float = 0.0
    square: float = 0.0
    cubic: float = 0.0
    cap: float = 0.0
    torsional: float = 0.0
    softening: float = 0.0

    @property
    def spin(self) -> bool | None:
        """True where crossings resist spin, None where they do not: kernels are compiled for the one or the other."""
        return True if self.torsional > 0.0 else None


class SoftLaw(NamedTuple):
    """Contact of soft yarns as a table over the distance of two centre-lines, see :mod:`knittest.kernels.soft_contact`.

    ``outer`` diameter and ``least`` distance of the table [mm], ``inv_step`` between its rows [1/mm]; ``pressure``
    [N/mm2] and ``energy`` [N/mm] at its rows, from the least distance to the outer diameter; stiffness ``steepest``
    below it and ``tangential`` while sticking [N/mm3]; Coulomb coefficient.
    """

    outer: float
    least: float
    inv_step: float
    pressure: Array
    energy: Array
    steepest: float
    tangential: float
    friction: float


class SoftPairs(NamedTuple):
    """Pairs of ``node`` (2, n) of soft yarns that are near each other.

    ``weight`` (n,) product of their lengths [mm2]; ``share`` (n,) that counts, as of :class:`Contacts`; ``spring``
    stretch of friction [mm] and ``force`` on the first node [N], (3, n). ``entry`` lists pair number and side
    (2 c + side) by node, from ``start`` (n_nodes + 1,) on.
    """

    node: Index
    weight: Array
    share: Array
    spring: Array
    force: Array
    start: Index
    entry: Index


class Tally(NamedTuple):
    """Accumulators over steps: ``reaction`` (PARTITIONS, n_groups) [N or N mm], conjugate to the table of each group,
    ``support`` (PARTITIONS, n_groups) [N or N mm], the same without the scales; energies (PARTITIONS, 9) [mJ].

    Energy columns: work of motions, loads and tools; losses of friction, in contacts and in the shear of shells;
    energy of eroded elements; losses of the damping of contacts and of free tools; of the losses of friction, those of
    spin at crossings of yarns, those at tools, and those in the shear of shells; energy that contacts found late were
    given; energy that damping relative to a guide gives back.
    ``late`` (1,) deepest overlap of a contact that was found late, over the smaller radius.
    ``tool`` (PARTITIONS, n_tools, 3) forces on the tools in this step, ``tool_sum`` (n_tools, 3) summed over steps [N].
    """

    reaction: Array
    energy: Array
    tool: Array
    tool_sum: Array
    support: Array
    late: Array


#: degrees of freedom of motions beyond those of the global axes: along and about ``Motions.axis``
ALONG, ABOUT = 6, 7
#: shapes of tools
PLANE, PLATE, CYLINDER, GRID, SWEPT = 0, 1, 2, 3, 4
#: columns of ``Tools.law``: penalty and sticking stiffness as multiples of each node's, static and kinetic coefficient
NORMAL, TANGENTIAL, STATIC, KINETIC = 0, 1, 2, 3


class Tables(NamedTuple):
    """Piecewise linear functions of time: time [ms] and value, (n_tables, most knots), constant outside.

    ``knots`` (n_tables,) of them count. ``now`` (2, n_tables) receives the values at the middles of the step before and
    of this one.
    """

    knots: Index
    time: Array
    value: Array
    now: Array


class Motions(NamedTuple):
    """Prescribed velocities, sorted by the partition that owns the node; start (PARTITIONS + 1,).

    Degree of freedom ``dof`` (0-2 translations [mm/ms], 3-5 spins [rad/ms], or those along and about ``axis``) of
    ``node`` moves with ``scale`` times table ``table``; all (n,), ``axis`` (n, 3). Reactions are summed by ``group``.
    """

    start: Index
    node: Index
    dof: Index
    table: Index
    scale: Array
    group: Index
    axis: Array


class Loads(NamedTuple):
    """Forces [N] and moments [N mm] that keep their direction, in runs of neighbouring nodes, sorted by partition as in
    :class:`Motions`.

    A run acts on ``dof`` of ``length`` nodes from ``node`` on, with table ``table`` times the entries of ``value`` from
    ``at`` on; (n_runs,) each. Where it ``guides`` (1, else 0), damping acts on the velocity relative to that of the
    table: ``value`` is then the momentum at a table of one.
    """

    start: Index
    node: Index
    length: Index
    at: Index
    dof: Index
    table: Index
    guides: Index
    value: Array


class Tools(NamedTuple):
    """Rigid bodies that translate; (n_tools, ...) each.

    ``kind``; ``size`` (4,): plate half lengths and edge radius, cylinder radius and half length [mm], grid spacing, of
    a swept edge with its radius [mm], sine and cosine of its draft;
    ``axes`` (3, 3) local axes as rows (a plane's outward normal is the third); ``position``, ``velocity`` (3,);
    ``plan`` (5,): of a swept edge, centre and half lengths of a box in plan, in local axes [mm], and 1 where the flat
    face goes on outside of it, 0 where nothing is there;
    ``motion`` (3,) velocity table of each axis, -1 if held, -2 if free to follow the forces; ``load`` (3,) force table
    or -1; ``mass`` [g] and ``drag`` [1/ms] of free axes; ``law`` (4,). ``grid`` (4,) offset in ``samples`` and counts
    of a sampled signed distance [mm], in plan only for a swept edge.
    """

    kind: Index
    size: Array
    axes: Array
    plan: Array
    position: Array
    velocity: Array
    motion: Index
    load: Index
    mass: Array
    drag: Array
    law: Array
    grid: Index
    samples: Array


class ToolContactState(NamedTuple):
    """Contact of nodes with tools.

    Of each node, (n_nodes,): ``radius`` [mm], penalty ``stiffness`` [N/mm] and ``viscous`` coefficient [N ms/mm]. Of
    each tool and node: sticking ``spring`` [mm], (n_tools, 3, n_nodes), ``slipping`` flag and normal force ``pressure``
    [N], (n_tools, n_nodes). Of each tool and block of nodes, within one call of the driver: ``room`` [mm], how far they
    may still come together before all are looked at, and how many are looked at until then, ``near_count``, (n_tools,
    n_blocks); their numbers are the first of the block's in ``near`` (n_tools, n_nodes).
    """

    radius: Array
    stiffness: Array
    viscous: Array
    spring: Array
    slipping: Array
    pressure: Array
    room: Array
    near: NDArray[np.int32]
    near_count: Index


class Drive(NamedTuple):
    """All that acts from outside."""

    tables: Tables
    motions: Motions
    loads: Loads
    tools: Tools
    touch: ToolContactState


#: numbers of the lattice: components of its two vectors, then the curvature
LATTICE, CURVATURE = 7, 6
#: columns of ``Images.map``: shift (3), its rate (3), turn, its rate, sine and cosine of the turn, arc that is bent
SHIFT, SHIFT_RATE, TURN, TURN_RATE, SINE, COSINE, ARC = 0, 3, 6, 7, 8, 9, 10
MAP = 11


class Images(NamedTuple):
    """Nodes that are images of others; a model that is not periodic has none.

    Node ``ghost`` follows node ``master``, (n_ghosts,), by the map of its image; its start is turned by ``gauge``
    (4, n_ghosts) from that of its master. ``of`` (n_nodes,) image of every node, 0 for the cell itself; ``times``
    (n_images, 2) how often the lattice vectors lie between; ``map`` (n_images, MAP) where that is now. ``cut`` (n_cut,
    2): beams from a node of the cell to an image, with their section.

    ``lattice`` (7,): both vectors of the fabric laid flat [mm], and its curvature [1/mm] along the first of ``axes``
    (3, 3), rows: along, normal, and the axis of bending. ``rate`` (7,) theirs in the last step, that of ``table``, or
    free with ``inv_mass`` [1/g] where that is not 0; ``pull`` (7,): derivatives of the elastic energy of the cell by
    them, whose sums go to the ``group`` of the reactions (-1: to none).
    """

    ghost: Index
    master: Index
    gauge: Array
    of: Index
    times: Array
    map: Array
    cut: Index
    lattice: Array
    rate: Array
    table: Index
    inv_mass: Array
    axes: Array
    pull: Array
    group: Index
