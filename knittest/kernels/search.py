"""Neighbour search for yarn contact: what to look at, cells, and crossings tracked from step to step.

Only pieces that moved by some share of the skin since they were last looked at are searched again, so a few recoiling
yarns do not cost a search over the whole fabric.
"""

from math import isnan, nan, sqrt

import numpy as np
from numba import njit

from knittest.kernels.contact import FIRST_ALONG, FIRST_END, LAST_END, POINT, SECOND_ALONG, penalty, tangent_of
from knittest.kernels.line_contact import SAME, add_to_lists, find_tracked, is_other_kind, predecessor
from knittest.kernels.pair_search import converge_point, reach_of
from knittest.kernels.section_blocks import ARM, OTHER, SHIFT, TOUCH
from knittest.kernels.vec import ALLOCATING, KERNEL, LANE_SUMS, PART, U, put3, rows3

#: share of the way that calls for a search from which on pieces are looked at along with it
SOON = 0.5
#: share of the skin that calls for a search. A piece goes on from where its nodes were when its partner was last
#: searched: each of both may close 1 + SOON times this way, unseen
REACHED = 0.5 / (1.0 + SOON)
#: distance along both yarns [elements] within which two tracked crossings merge
MERGE = 0.25
#: the same within which a crossing found beside a tracked one is that one, where both are at rest at their minimum
ALIKE = 0.3
#: overlap over the smaller radius above which a contact of cut ends that comes into view is left alone, and pieces
#: beside a cut end that such a contact may have come to
JAMMED, NEAR_CUT = 0.05, 2
#: overlap over the smaller radius that is given force at least in one step of a recovery, so that it ends
REST = 1e-3


@njit(**ALLOCATING)
def fill_cells(x, y, z, is_piece, cell, origin, shape, head, order):
    """Counting sort of pieces into cubic cells; ``head`` (n_cells + 1,) starts, ``order`` piece numbers by cell."""
    head[:] = 0
    n = is_piece.size
    cell_of = np.full(n, -1, np.int64)
    for i in range(n):
        if is_piece[i]:
            a = int((x[i] - origin[0]) / cell)
            b = int((y[i] - origin[1]) / cell)
            c = int((z[i] - origin[2]) / cell)
            cell_of[i] = (a * shape[1] + b) * shape[2] + c
            head[cell_of[i] + 1] += 1
    for c in range(head.size - 1):
        head[c + 1] += head[c]
    cursor = head[:-1].copy()
    for i in range(n):
        if cell_of[i] >= 0:
            order[cursor[cell_of[i]]] = i
            cursor[cell_of[i]] += 1
    return cell_of


@njit(**ALLOCATING)
def flag_moved(nodes, since, ahead, limit, moved):
    """Count nodes that moved, or will within ``ahead`` [ms], by ``limit`` [mm] from ``since`` (3, n).

    Fills ``moved`` (n,) with those that went :data:`SOON` of it, whose turn would come next: a search goes through all
    lists whatever it looks for. Returns the count and the largest speed [mm/ms].
    """
    still, origin = np.zeros((2, 3, 4)), np.zeros((3, moved.size))
    count, _, fastest = flag_deviating(nodes, origin, still, since, ahead, limit, moved)
    return count, fastest


@njit(**ALLOCATING)
def flag_deviating(nodes, reference, motion, since, ahead, limit, moved):
    """:func:`flag_moved` for displacements relative to the affine ``motion`` of :func:`fit_motion`.

    ``since`` (3, n) are the relative displacements at the last search of each node [mm], ``reference`` (3, n) the
    positions where the affine motion began. Returns the count, the largest relative displacement from there within
    ``ahead`` [mm] and the largest speed [mm/ms].
    """
    x, y, z = rows3(nodes.position)
    vx, vy, vz = rows3(nodes.velocity)
    x0, y0, z0 = rows3(reference)
    wx, wy, wz = rows3(since)
    count, fastest2, farthest = 0, np.zeros(LANE_SUMS), np.zeros(LANE_SUMS)
    a00, a01, a02, a03 = motion[0, 0, 0], motion[0, 0, 1], motion[0, 0, 2], motion[0, 0, 3]
    a10, a11, a12, a13 = motion[0, 1, 0], motion[0, 1, 1], motion[0, 1, 2], motion[0, 1, 3]
    a20, a21, a22, a23 = motion[0, 2, 0], motion[0, 2, 1], motion[0, 2, 2], motion[0, 2, 3]
    b00, b01, b02, b03 = motion[1, 0, 0], motion[1, 0, 1], motion[1, 0, 2], motion[1, 0, 3]
    b10, b11, b12, b13 = motion[1, 1, 0], motion[1, 1, 1], motion[1, 1, 2], motion[1, 1, 3]
    b20, b21, b22, b23 = motion[1, 2, 0], motion[1, 2, 1], motion[1, 2, 2], motion[1, 2, 3]
    for block in range(0, moved.size, LANE_SUMS):
        for k in range(U(min(LANE_SUMS, moved.size - block))):
            i = U(block) + k
            px, py, pz = x0[i], y0[i], z0[i]
            dx = x[i] - px - (a00 * px + a01 * py + a02 * pz + a03)
            dy = y[i] - py - (a10 * px + a11 * py + a12 * pz + a13)
            dz = z[i] - pz - (a20 * px + a21 * py + a22 * pz + a23)
            ux = vx[i] - (b00 * px + b01 * py + b02 * pz + b03)
            uy = vy[i] - (b10 * px + b11 * py + b12 * pz + b13)
            uz = vz[i] - (b20 * px + b21 * py + b22 * pz + b23)
            coming = ahead * sqrt(ux * ux + uy * uy + uz * uz)
            reached = coming + sqrt((dx - wx[i]) ** 2 + (dy - wy[i]) ** 2 + (dz - wz[i]) ** 2)
            moved[i] = reached >= SOON * limit
            count += reached >= limit
            speed2, far = vx[i] ** 2 + vy[i] ** 2 + vz[i] ** 2, coming + sqrt(dx * dx + dy * dy + dz * dz)
            fastest2[k] = speed2 if speed2 > fastest2[k] else fastest2[k]
            farthest[k] = far if far > farthest[k] else farthest[k]
    return count, farthest.max(), sqrt(fastest2.max())


@njit(**ALLOCATING)
def fit_motion(nodes, reference, flexibility, stride, motion):
    """Fit an affine motion to the displacements of every ``stride``-th node from its ``reference`` (3, n) [mm].

    Fills ``motion`` (2, 3, 4): gradient and displacement at the origin [mm], then their rates [1/ms, mm/ms].
    ``flexibility`` (4, 4) as :func:`motion_basis` gives it.
    """
    sums = np.zeros((2, 3, 4))
    for i in range(0, reference.shape[1], stride):
        for axis in range(3):
            moved, speed = nodes.position[axis, i] - reference[axis, i], nodes.velocity[axis, i]
            for k in range(3):
                sums[0, axis, k] += moved * reference[k, i]
                sums[1, axis, k] += speed * reference[k, i]
            sums[0, axis, 3] += moved
            sums[1, axis, 3] += speed
    for m in range(2):
        for axis in range(3):
            for k in range(4):
                motion[m, axis, k] = 0.0
                for other in range(4):
                    motion[m, axis, k] += sums[m, axis, other] * flexibility[other, k]


def motion_basis(reference, smooth):
    """Matrix (4, 4) by which :func:`fit_motion` gets an affine motion from sums over the ``reference`` (3, n) [mm].

    A least-squares fit, in which a gradient costs as much as scatter of the displacements by it over ``smooth`` [mm].
    """
    n, middle = reference.shape[1], reference.mean(axis=1)
    arms = reference - middle[:, None]
    inverse = np.linalg.inv((arms[:, None] * arms[None]).sum(axis=2) + n * smooth**2 * np.eye(3))
    last = inverse @ middle
    return np.block([[inverse, -last[:, None]], [-last[None], np.array([[1.0 / n + middle @ last]])]])


def largest_speed(nodes):
    """Largest speed of a node [mm/ms]."""
    return float(np.sqrt((nodes.velocity**2).sum(axis=0).max(initial=0.0)))


@njit(**PART)
def _copy(source, a, target, b):
    for side in range(2):
        target.piece[side, b], target.parameter[side, b] = source.piece[side, a], source.parameter[side, a]
    for k in range(3):
        target.spring[k, b], target.offset[k, b] = source.spring[k, a], source.offset[k, a]
        target.force[k, b] = source.force[k, a]
        target.tangent[k, b], target.other_tangent[k, b] = source.tangent[k, a], source.other_tangent[k, a]
    target.slipping[b], target.line[b] = source.slipping[a], source.line[a]
    target.reach[b], target.arm[b] = source.reach[a], source.arm[a]
    target.twist[b], target.couple[b] = source.twist[a], source.couple[a]
    target.lever[0, b], target.lever[1, b] = source.lever[0, a], source.lever[1, a]
    if source.excess.size > 0:
        for k in range(3):
            target.shift[k, b], target.other[k, b] = source.shift[k, a], source.other[k, a]
        target.touch[b] = source.touch[a]
    target.accepted[b] = source.accepted[a]


@njit(**PART)
def _gap(contacts, c):
    """Distance of the closest points of contact ``c`` [mm]."""
    return sqrt(contacts.offset[0, c] ** 2 + contacts.offset[1, c] ** 2 + contacts.offset[2, c] ** 2)


@njit(**PART)
def _needs_search(i, j, s, t, line, moved, pieces):
    """Return whether a contact of the kind ``line`` is searched again: it changed its kind, or is held at the middle of
    a piece that moved.
    """
    held = t if line == SECOND_ALONG else s
    return is_other_kind(line, i, j, pieces) or (line != POINT and held == 0.5 and (moved[i] or moved[j]))


@njit(**PART)
def _is_within_pieces(s, first, t, second):
    """Return whether parameters ``s`` and ``t`` are within those of their pieces, (least, largest) each."""
    return s >= first[0] and s <= first[1] and t >= second[0] and t <= second[1]


@njit(**PART)
def keep_contacts(old, count, radius, pieces, alive, moved, skin, new, lists, taken):
    """Copy tracked contacts that are still near into ``new`` and its ``lists``; returns how many.

    Two contacts that ran into the same crossing become one, which stores the energy of both. A reach that was cut when
    the contact was found inside (see :func:`find_contacts`) grows back as the gap opens. Those kept are ``taken``: they
    have no other heir.
    """
    kept = 0
    for c in range(count):
        s, t = old.parameter[0, c], old.parameter[1, c]
        i, j, line = old.piece[0, c], old.piece[1, c], old.line[c]
        if _needs_search(i, j, s, t, line, moved, pieces):
            continue
        beyond = s <= FIRST_END or s >= LAST_END or t <= FIRST_END or t >= LAST_END
        if beyond and not _is_within_pieces(s, reach_of(i, alive, pieces), t, reach_of(j, alive, pieces)):
            continue
        if alive[i - 1] * alive[i] * alive[j - 1] * alive[j] == 0.0:
            continue
        gap = _gap(old, c)
        if gap >= old.reach[c] + skin:
            continue
        touch = radius[i] + radius[j]
        if old.excess.size > 0 and old.touch[c] > 0.0:
            touch = old.touch[c]
        reach = min(touch, max(old.reach[c], gap))
        taken[c] = True
        same = find_tracked(new, lists, pieces.chain, (i, j, s, t, line), MERGE)
        if same >= 0:
            pressed, depth = max(new.reach[same] - _gap(new, same), 0.0), max(reach - gap, 0.0)
            both = _gap(new, same) + sqrt(pressed * pressed + depth * depth)
            new.reach[same] = max(new.reach[same], min(touch - new.accepted[same], both))
            continue
        _copy(old, c, new, kept)
        new.reach[kept] = reach
        add_to_lists(new, kept, lists)
        kept += 1
    return kept


@njit(**PART)
def _add_contact(i, j, s, t, wx, wy, wz, line, touch, arm, coefficient, most, old, before, new, c):
    """Write contact ``c``; it inherits the spring of ``before`` in ``old`` unless that is -1.

    One of the same pieces goes on where it was. Any other looks back on no step: its offset is the present one, and
    without a force the kernel counts no turn of its surfaces as slide. What is inherited is the depth, not the reach:
    found where the gap is smaller, it would press by more. Returns whether it went on.
    """
    gap = sqrt(wx * wx + wy * wy + wz * wz)
    reach = min(touch, gap)
    new.spring[:, c], new.slipping[c], new.twist[c] = 0.0, 0.0, 0.0
    new.accepted[c] = 0.0
    goes_on = False
    if before >= 0:
        _copy(old, before, new, c)
        goes_on = old.line[before] == line and new.piece[0, c] == i and new.piece[1, c] == j
        own = _gap(old, before)
        reach = min(touch, (own if goes_on else gap) + max(new.reach[c] - own, 0.0))
    if not goes_on:
        new.force[:, c], new.couple[c] = 0.0, 0.0
        new.piece[0, c], new.piece[1, c] = i, j
        new.parameter[0, c], new.parameter[1, c] = s, t
        new.offset[0, c], new.offset[1, c], new.offset[2, c] = wx, wy, wz
    new.reach[c], new.arm[c], new.line[c] = reach, arm, line
    # yarns side by side, or in a row, already resist spin by friction along their line
    new.lever[0, c], new.lever[1, c] = coefficient, most if line == POINT else 0.0
    return goes_on


@njit(**PART)
def _second_crossing(c, place, position, alive, lists, new, pieces):
    """Place of the crossing found at ``place``, pieces i, j at s, t, as s, t and offset (3), if it is another one than
    the tracked contact ``c``; else s is nan.

    Yarns that bend towards each other may be nearest in two places less than an element apart. They differ
    where the closest points converge: both at minima of the distance, each on its own side.
    """
    x, y, z = rows3(position)
    i, j, s, t = place
    s, t, wx, wy, wz = converge_point(x, y, z, i, j, s, t)
    of_i, of_j = reach_of(i, alive, pieces), reach_of(j, alive, pieces)
    if (
        not _is_within_pieces(s, of_i, t, of_j)
        or find_tracked(new, lists, pieces.chain, (i, j, s, t, POINT), ALIKE) >= 0
    ):
        return nan, t, wx, wy, wz
    own_s, own_t = new.parameter[0, c], new.parameter[1, c]
    rest_s, rest_t = converge_point(x, y, z, new.piece[0, c], new.piece[1, c], own_s, own_t)[:2]
    if not (abs(rest_s - own_s) < MERGE and abs(rest_t - own_t) < MERGE):
        return nan, t, wx, wy, wz
    return s, t, wx, wy, wz


@njit(**PART)
def _share_depth(c, other, touch, contacts):
    """Let the contact ``other``, just found beside ``c``, take over up to half of the energy that ``c`` stores.

    Each is pressed by the depth over the square root of two, ``other`` by no more than it overlaps by ``touch`` [mm];
    ``c`` keeps the rest. Without that a second minimum that comes up beside a loaded one would start without force.
    """
    gap, own = _gap(contacts, other), _gap(contacts, c)
    depth = max(contacts.reach[c] - own, 0.0)
    taken = min(depth * sqrt(0.5), max(touch - contacts.accepted[c] - gap, 0.0))
    contacts.reach[other] = max(contacts.reach[other], min(touch, gap + taken))
    contacts.reach[c] = min(contacts.reach[c], own + sqrt(depth * depth - taken * taken))
    contacts.accepted[other] = contacts.accepted[c]


@njit(**PART)
def _add_sections(place, elliptic, new, c):
    """Write the sections of contact ``c``, as :func:`knittest.kernels.section_blocks.place_ellipses` placed them."""
    for k in range(3):
        new.shift[k, c] = place[SHIFT + k] if elliptic else 0.0
        new.other[k, c] = place[OTHER + k] if elliptic else 0.0
    new.touch[c] = place[TOUCH] if elliptic else 0.0


@njit(**PART)
def _is_near_cut_end(i, j, pieces):
    """Return whether one of the pieces ``i``, ``j`` is cut off and the other, too, or within :data:`NEAR_CUT`."""
    if not (pieces.cut[i] or pieces.cut[j]):
        return False
    other, n = j if pieces.cut[i] else i, pieces.cut.size
    for k in range(max(other - NEAR_CUT, 0), min(other + NEAR_CUT + 1, n)):
        if pieces.cut[k] and pieces.chain[k] == pieces.chain[other]:
            return True
    return False


@njit(**PART)
def _reset_tangents(c, position, contacts):
    """Let contact ``c`` look back on its present tangents: it has not been where it is."""
    x, i, j = rows3(position), U(contacts.piece[0, c]), U(contacts.piece[1, c])
    put3(rows3(contacts.tangent), c, tangent_of(i, contacts.parameter[0, c], x))
    put3(rows3(contacts.other_tangent), c, tangent_of(j, contacts.parameter[1, c], x))


@njit(**ALLOCATING)
def find_contacts(
    position, pairs, places, found, radius, part, levers, pieces, alive, moved, skin, old, old_count, new
):
    """Contacts of the pairs that :func:`knittest.kernels.pair_search.find_pairs` found, and those tracked before.

    Tracked ones keep parameters and springs. A pair found overlapping (at the start, or where a broken end slid in)
    touches from its present gap on, so that it brings no energy; :func:`recover_overlaps` then gives it force.
    ``position`` (3, n_nodes), ``radius`` and ``skin`` [mm]. ``levers`` (2, n_parts, n_parts) of the friction moment by
    the ``part`` (n_nodes,) of either yarn. Returns the number needed, which may exceed the capacity of ``new``; nothing
    is dropped.
    """
    n, chain = pieces.chain.size, pieces.chain
    lists = np.full(n, -1), np.empty(new.reach.size, np.int64)
    old_lists, taken = (np.full(n, -1), np.empty(old.reach.size, np.int64)), np.zeros(old.reach.size, np.bool_)
    for c in range(old_count):
        add_to_lists(old, c, old_lists)
    needed = keep_contacts(old, old_count, radius, pieces, alive, moved, skin, new, lists, taken)
    for share in range(found.size):
        for k in range(found[share]):
            i, j = pairs[share, k, 0], pairs[share, k, 1]
            if i < 0:  # ellipses that are not near each other
                continue
            place = places[share, k]
            s, t, wx, wy, wz, line = place[0], place[1], place[2], place[3], place[4], place[5]
            # a tracked crossing is no other one, nor a line beside itself once its yarns lie parallel again
            known = POINT if line < FIRST_ALONG else line
            same = find_tracked(new, lists, chain, (i, j, s, t, known), SAME)
            elliptic = new.excess.size > 0 and (new.excess[i] != 0.0 or new.excess[j] != 0.0)
            if same >= 0:
                if elliptic or line != POINT:
                    continue
                s, t, wx, wy, wz = _second_crossing(same, (i, j, s, t), position, alive, lists, new, pieces)
                if isnan(s):
                    continue
            if needed < new.reach.size:
                before = predecessor(old, old_lists, chain, taken, (i, j, s, t, line))
                touch = place[TOUCH] if elliptic else radius[i] + radius[j]
                deep = touch - sqrt(wx * wx + wy * wy + wz * wz) > JAMMED * min(radius[i], radius[j])
                if deep and before < 0 and old_count > 0 and _is_near_cut_end(i, j, pieces):
                    continue  # it lay in another cut end, which does not press it
                arm = place[ARM] if elliptic else radius[i] / touch
                coefficient, most = levers[0, part[i], part[j]], levers[1, part[i], part[j]]
                goes_on = _add_contact(
                    i, j, s, t, wx, wy, wz, line, touch, arm, coefficient, most, old, before, new, needed
                )  # fmt: skip
                if not goes_on:
                    _reset_tangents(needed, position, new)
                    if new.excess.size > 0:
                        _add_sections(place, elliptic, new, needed)
                    if line >= FIRST_ALONG and (t if line == SECOND_ALONG else s) != 0.5:
                        beside = (i, j, s, 0.5, line) if line == SECOND_ALONG else (i, j, 0.5, t, line)
                        same = find_tracked(new, lists, chain, beside, SAME)
                    if same >= 0:
                        _share_depth(same, needed, touch, new)
                add_to_lists(new, needed, lists)
            needed += 1
    return needed


@njit(**KERNEL)
def recover_overlaps(contacts, count, radius, law, free, share, most):
    """Give force to overlaps that came without one after the start; returns the energy given [mJ], how many contacts
    have more to be given, and the deepest overlap that was without force, over the smaller radius.

    ``radius`` (n_nodes,) [mm]. ``free`` overlap that may stay, over the smaller radius. A ``share`` of the rest is
    given force now, up to ``most`` of the smaller radius.
    """
    given, waiting, deepest = 0.0, 0, 0.0
    for c in range(count):
        i, j = contacts.piece[0, c], contacts.piece[1, c]
        touch = radius[i] + radius[j]
        if contacts.touch.size > 0 and contacts.touch[c] > 0.0:
            touch = contacts.touch[c]
        least, gap = min(radius[i], radius[j]), _gap(contacts, c)
        goal, reach = touch - contacts.accepted[c] - free * least, contacts.reach[c]
        if goal <= max(reach, gap):
            continue
        deepest = max(deepest, (goal - max(reach, gap)) / least)
        missing = goal - max(reach, gap)
        grown = goal - missing + min(max(share * missing, REST * least), most * least, missing)
        before = penalty(max(reach - gap, 0.0), law.normal, law.linear, law.square, law.cubic, law.cap)[2]
        after = penalty(grown - gap, law.normal, law.linear, law.square, law.cubic, law.cap)[2]
        given += contacts.share[c] * (after - before)
        contacts.reach[c] = grown
        waiting += grown < goal
    return given, waiting, deepest


@njit(**ALLOCATING)
def assign_halves(contacts, count, node_cut):
    """Sort both sides of every contact by the partition that owns the node; fills half and half_start."""
    parts = node_cut.size - 1
    owner = np.zeros(node_cut[parts] + 1, np.int64)
    for p in range(parts):
        owner[node_cut[p] : node_cut[p + 1]] = p
    contacts.half_start[:] = 0
    for c in range(count):
        for side in range(2):
            contacts.half_start[owner[contacts.piece[side, c]] + 1] += 1
    for p in range(parts):
        contacts.half_start[p + 1] += contacts.half_start[p]
    cursor = contacts.half_start.copy()
    for c in range(count):
        for side in range(2):
            p = owner[contacts.piece[side, c]]
            contacts.half[cursor[p]] = 2 * c + side
            cursor[p] += 1
