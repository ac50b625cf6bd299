"""A periodic cell of yarns: chains that go on in their own images, with the images that its yarns may touch."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from math import ceil

import numpy as np
from numpy.typing import ArrayLike

from knittest.base.arrays import Array, Flags, Index
from knittest.base.errors import InputError
from knittest.kernels.flattening import STIFF
from knittest.kernels.state import LATTICE, MAP, Images, Partitions
from knittest.kernels.vec import PARTITIONS
from knittest.models.chains import Chain, MassScaling, build_chains
from knittest.models.contact_tracker import CONTACT_SKIN
from knittest.models.inputs import finite_array
from knittest.models.natural_state import quaternion_product
from knittest.models.periodic_model import PeriodicModel
from knittest.models.yarn_contact import YarnContact
from knittest.models.yarn_model import YarnModel, section_of_nodes

#: images of a chain's own nodes that its beams and contacts need, at either end
ENDS = 3
#: pieces that ellipses touch off where centre-lines are nearest, where they are looked for
OFF = 3
#: way [mm] that yarns may slide along each other before images are missing, over the largest radius
SLIDE = 2.0
#: smallest mean stretch [-] of a cell that images are kept for: a trellis sheared by 40 deg
SHRINK = 0.6


@dataclass(frozen=True)
class PeriodicChain(Chain):
    """Yarn that goes on in its own image: ``points`` (n, 3) [mm] are one period of it, of n elements, the last of which
    ends where the image by the lattice vector ``along`` (0 or 1) begins.
    """

    along: int = 0


@dataclass(frozen=True)
class _Piece:
    """Nodes ``first`` to ``stop`` of ``chain`` counted from the start of its own period, moved by ``across`` of the
    other lattice vector.
    """

    chain: int
    first: int
    stop: int
    across: int


def build_periodic(
    chains: Sequence[PeriodicChain],
    lattice: ArrayLike,
    part_names: tuple[str, ...],
    contact: YarnContact | None = None,
    scaling: MassScaling | None = None,
    halo: float | None = None,
    shrink: float = SHRINK,
    slide: float = SLIDE,
) -> PeriodicModel:
    """Model of one cell of ``chains`` that repeats by both vectors of ``lattice`` (2, 3) [mm].

    Images are kept up to ``halo`` [mm] from the nodes of the cell: by default what contacts reach where the mean
    deformation brings lines to ``shrink`` of their length, and the way ``slide`` that yarns slide, over the largest
    radius.
    Raises :class:`InputError` for a lattice without an area, and for chains of fewer than three elements.
    """
    vectors = finite_array(lattice, "lattice [mm]", (2, 3))
    _heights(vectors)
    for number, chain in enumerate(chains):
        if len(chain.points) < ENDS or chain.along not in (0, 1):
            raise InputError(
                f"chain {number}: {len(chain.points)} elements per period, along {chain.along}; expected at least "
                f"{ENDS}, along lattice vector 0 or 1"
            )
    contact = contact and replace(contact, cut=0)  # ends of images are no ends of yarns
    pieces = _pieces(chains, vectors, _reach(chains, vectors, contact, shrink, slide) if halo is None else halo)
    long = [_extend_chain(chains[p.chain], p, vectors) for p in pieces]
    flat = build_chains(long, part_names, contact, scaling)
    own, master, times = _masters(chains, pieces)
    plain = flat.mass if scaling is None else build_chains(long, part_names, contact).mass
    return _periodic(flat, vectors, own, master, times, float(flat.mass[own].sum() / plain[own].sum() - 1.0))


def _heights(vectors: Array) -> Array:
    """Heights [mm], (2,), of the parallelogram of the lattice over each of its sides."""
    area = float(np.linalg.norm(np.cross(*vectors)))
    if not area > 1e-9 * float(np.linalg.norm(vectors)) ** 2:
        raise InputError("lattice: expected two vectors that are not parallel")
    return np.asarray(area / np.linalg.norm(vectors[::-1], axis=1))


def _reach(
    chains: Sequence[PeriodicChain], vectors: Array, contact: YarnContact | None, shrink: float, slide: float
) -> float:
    """Distance [mm] from nodes of the cell at the start within which pieces may come to touch theirs."""
    radius = max(chain.section.wide for chain in chains)
    if contact is not None and contact.shell is not None:
        radius = max(radius, 0.5 * contact.shell.outer)
    elements = (np.diff(c.points, axis=0, append=c.points[:1] + vectors[c.along]) for c in chains)
    longest = max(float(np.linalg.norm(of, axis=1).max()) for of in elements)
    return (2.0 * radius + CONTACT_SKIN + longest) / shrink + slide * radius


def _pieces(chains: Sequence[PeriodicChain], vectors: Array, reach: float) -> list[_Piece]:
    """Chains of the cell, each followed by its images that come within ``reach`` [mm] of a node of it."""
    from scipy.spatial import cKDTree

    own = [np.asarray(c.points, float) for c in chains]
    tree = cKDTree(np.vstack(own))
    places = np.linalg.lstsq(vectors.T, np.vstack(own).T, rcond=None)[0].T
    most = [ceil(v) + 1 for v in np.ptp(places, axis=0) + reach / _heights(vectors)]
    found = []
    for number, (chain, points) in enumerate(zip(chains, own, strict=True)):
        n, along, other = len(points), vectors[chain.along], vectors[1 - chain.along]
        count = np.arange(-most[chain.along] * n, (most[chain.along] + 1) * n)
        flat = points[count % n] + (count // n)[:, None] * along
        for across in sorted(range(-most[1 - chain.along], most[1 - chain.along] + 1), key=abs):
            inside = count[tree.query(flat + across * other, distance_upper_bound=1.001 * reach)[0] <= reach]
            if across == 0:
                inside = np.append(inside, [-ENDS, n + ENDS])
            if len(inside):  # a piece needs a node on either side
                first = int(inside.min()) - 1
                found.append(_Piece(number, first, max(int(inside.max()) + 2, first + ENDS), across))
    return found


def _extend_chain(chain: PeriodicChain, piece: _Piece, vectors: Array) -> Chain:
    """The chain of ``piece`` with all its nodes."""
    count, n = np.arange(piece.first, piece.stop), len(chain.points)
    points = np.asarray(chain.points, float)[count % n] + (count // n)[:, None] * vectors[chain.along]
    elements = {
        name: value if np.ndim(value) == 0 else np.asarray(value)[count[:-1] % n]
        for name in ("fail_strain", "slack", "degree_of_set", "loop_shortening")
        for value in (getattr(chain, name),)
    }
    normal = chain.normal
    if normal is not None and np.ndim(normal) == 2:
        normal = np.asarray(normal)[count[:-1] % n]
    return Chain(
        points + piece.across * vectors[1 - chain.along], chain.section, chain.part, stretch=chain.stretch,
        normal=normal, **elements,
    )  # fmt: skip


def _masters(chains: Sequence[PeriodicChain], pieces: list[_Piece]) -> tuple[Flags, Index, Index]:
    """Flag of the cell's own nodes, the node that each follows, and its image (n, 2)."""
    start, first_own = 0, {}
    for piece in pieces:
        if piece.across == 0:
            first_own[piece.chain] = start - piece.first
        start += piece.stop - piece.first
    own, master, times = [], [], []
    for piece in pieces:
        count, n = np.arange(piece.first, piece.stop), len(chains[piece.chain].points)
        image = np.empty((len(count), 2), np.int64)
        image[:, chains[piece.chain].along], image[:, 1 - chains[piece.chain].along] = count // n, piece.across
        own.append((image == 0).all(axis=1))
        master.append(first_own[piece.chain] + count % n)
        times.append(image)
    return np.concatenate(own), np.concatenate(master), np.concatenate(times)


def _periodic(flat: YarnModel, vectors: Array, own: Flags, master: Index, times: Index, added: float) -> PeriodicModel:
    """``flat`` with the nodes that are not ``own`` as images of their masters."""
    given = {f.name: getattr(flat, f.name) for f in fields(flat) if f.init}
    ghost, element = np.flatnonzero(~own), flat.element_node
    kept = own[element]
    n = flat.n_nodes
    near = _flag_near_pieces(own, OFF if flat.group.excess.size else 0)
    mesh, section = flat.mesh, section_of_nodes(flat.parts, n)
    given["mesh"] = replace(mesh, **{name: getattr(mesh, name)[kept] for name in ("cells", "part", "yarn", "radius")})
    images = _images(flat, vectors, ghost, master, times, element[kept], section)
    length = np.where(own, flat.group.length, flat.group.length[master])
    group = replace(flat.group, owned=own.astype(float), near=near, images=images, length=length)
    given |= {"images": images, "group": group}
    if flat.group.shape.size:
        flat.group.shape[STIFF, ghost] = 0.0  # images follow
    for array in (flat.mass, flat.inertia, flat.nodes.inv_mass[:n], flat.nodes.inv_inertia[:n]):
        array[ghost] = 0.0
    given |= {"added_mass": added, "element_node": element[kept], "parts": _own_spans(flat.parts, own, section)}
    return PeriodicModel(**given, reference=vectors)


def _flag_near_pieces(own: Flags, off: int) -> Flags:
    """Pieces, (n_nodes,), with a node that is ``own``, or ``off`` pieces from one at most."""
    return np.any([np.roll(own, k) for k in range(-1 - off, 2 + off)], axis=0)


def _own_spans(parts: Partitions, own: Flags, section: Index) -> Partitions:
    """``parts`` with spans of the cell's nodes alone, each after the one image whose beam ends in it."""
    edge = np.flatnonzero(np.diff(np.concatenate([[0], own.astype(np.int64), [0]])))
    spans: list[list[int]] = []
    start = [0]
    for p in range(PARTITIONS):
        for first, stop in zip(edge[::2], edge[1::2], strict=True):
            if parts.node[p] <= first < parts.node[p + 1]:
                spans.append([int(first) - 1, int(stop), int(section[first])])
        start.append(len(spans))
    return Partitions(parts.node, np.array(start, np.int64), np.array(spans, np.int64).reshape(-1, 3))


def _images(
    flat: YarnModel, vectors: Array, ghost: Index, master: Index, times: Index, element: Index, section: Index
) -> Images:
    """Arrays of the kernel: the lattice at rest, every image turned from its master as chains start."""
    distinct, of = np.unique(np.vstack([[[0, 0]], times]), axis=0, return_inverse=True)
    origin = int(of.ravel()[0])
    order = np.concatenate([[origin], np.delete(np.arange(len(distinct)), origin)])
    rank = np.argsort(order)
    cut = element[np.isin(element + 1, ghost)]
    along = vectors[0] / np.linalg.norm(vectors[0])
    axis = np.cross(vectors[0], vectors[1])
    normal = axis / np.linalg.norm(axis)
    lattice, zero = np.append(vectors.ravel(), 0.0), np.zeros(LATTICE)
    rotation = flat.nodes.rotation[:, :-1].T
    # h with rotation of the image = rotation of its master times h
    gauge = quaternion_product(rotation[master[ghost]] * [1.0, -1.0, -1.0, -1.0], rotation[ghost]).T
    maps = np.zeros((len(distinct), MAP))
    maps[:, :3] = distinct[order] @ vectors
    maps[:, 9] = 1.0
    return Images(
        ghost, master[ghost], np.ascontiguousarray(gauge), rank[of.ravel()[1:]].astype(np.int64),
        distinct[order].astype(float), maps, np.column_stack([cut, section[cut]]), lattice, zero,
        np.zeros(LATTICE, np.int64), zero.copy(), np.array([along, normal, np.cross(along, normal)]), zero.copy(),
        np.full(LATTICE, -1),
    )  # fmt: skip
