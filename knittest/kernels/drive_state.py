"""Actions on a model from outside, as NamedTuples: motions, loads and rigid tools."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

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
