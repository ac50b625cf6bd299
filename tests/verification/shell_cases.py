"""Meshes, materials and small solvers for the verification of the shells."""

import numpy as np

from knittest.config.fabric import Fabric
from knittest.kernels.shell_blocks import gather_shells, shell_forces
from knittest.kernels.shell_output import shell_energies
from knittest.kernels.shell_state import BLOCK, SCRATCH, Laminate, Shells
from knittest.kernels.state import Nodes
from knittest.models.explicit_model import make_nodes

X, Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
#: an irregular mesh of five quadrilaterals (MacNeal & Harder, 1985), on 24 x 12 mm
PATCH = 100.0 * np.array(
    [
        [0, 0, 0], [0.24, 0, 0], [0.24, 0.12, 0], [0, 0.12, 0],
        [0.04, 0.02, 0], [0.18, 0.03, 0], [0.16, 0.08, 0], [0.08, 0.08, 0],
    ]
)  # fmt: skip
PATCH_CONN = np.array([[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 6, 7]])


def linear_laminate(warp: float = 900.0, weft: float = 600.0, **changes) -> Laminate:
    """Linear law: membrane stiffness [N/mm] of both directions, D = 4.84 and 3.63 N mm, same in compression."""
    layer_offset, outer = 1.1, np.array([2.0, 1.5])
    middle = np.array([warp, weft]) - 2.0 * outer
    material = Laminate(
        layer_offset=layer_offset, outer=outer, compression=middle, knee=np.zeros((2, 1)), slope=middle[:, None].copy(),
        shear_knee=np.zeros(1), shear_slope=np.array([0.5]), shear_friction=0.0, shear_stick=0.5, twist=0.4,
        transverse=np.array([4.0, 5.0]),
        hourglass_fibre=np.full(2, 3.0), hourglass_shear=0.25, hourglass_bending=0.02, hourglass_transverse=0.05,
        drilling=0.05,
        fail_strain=np.full(2, np.inf),
    )  # fmt: skip
    return material._replace(**changes)


def fabric(**macro) -> Fabric:
    """Variant 1 of Pham et al. (2019) as far as the macro model reads it, with changes to its macro part."""

    def q(value: float) -> dict:
        return {"value": value, "source": "assumed"}

    yarn = {
        "linear_density": q(1200), "beam_diameter": q(0.75), "youngs_modulus": q(59.3), "load_area": q(0.784),
        "fracture_strain": q(1.0),
    }  # fmt: skip
    both = {"warp": q(0.1), "weft": q(0.1)}
    laminate = {
        "tension": {"warp": "warp.csv", "weft": "weft.csv"}, "fracture_strain": {"warp": q(1.6), "weft": q(1.5)},
        "bending_stiffness": {"warp": q(5.05), "weft": q(3.48)}, "shear": {"stiffness": q(0.5)},
        "compression_ratio": q(0.01),
    }  # fmt: skip
    return Fabric.model_validate(
        {
            "name": "V1", "warp_density": q(28), "weft_density": q(28), "loop_length": q(14.4), "area_mass": q(824.2),
            "thickness": q(2.22),
            "reinforcing": {**yarn, "bending_stiffness": both, "crimp": both, "crimp_scatter": both, "slack": both},
            "knitting": {
                **yarn, "linear_density": q(230), "load_area": q(0.136), "bending_stiffness": q(0.1),
                "degree_of_set": q(1.0),
            },
            "contact": {"friction_coefficient": q(0.15), "normal_stiffness": q(500), "tangential_ratio": q(0.5)},
            "macro": {**laminate, **macro},
        }
    )  # fmt: skip


def per_width(curves, width=50.0):
    """``curves`` of strips of ``width`` [mm] as the laminate takes them: force [N/mm]."""
    return {direction: (strain, np.asarray(force, float) / width) for direction, (strain, force) in curves.items()}


def toe_curve(peak: float, strain: float, points: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Strain [%] and force [N]: a parabola up to half the strain, then its tangent, to ``peak``."""
    e = np.linspace(0.0, strain, points)
    toe = 0.5 * strain
    force = np.where(e < toe, e**2 / (2.0 * toe) + 0.05 * e, 1.05 * e - 0.5 * toe)
    return e, peak * force / force[-1]


CURVES = {"warp": toe_curve(5820.0, 1.6), "weft": toe_curve(5744.0, 1.6)}


class Solid:
    """Nodes and shells with their forces; positions and rotations may be set freely."""

    def __init__(self, position: np.ndarray, shells: Shells, laminate: Laminate) -> None:
        ones = np.ones(len(position))
        self.n, self.start, self.shells, self.laminate = len(position), position.copy(), shells, laminate
        self.nodes: Nodes = make_nodes(position, ones, ones)
        self.blocks = len(shells.fail_time) // BLOCK
        self.eroded, self.friction_losses, self.scratch = 0.0, 0.0, np.zeros(SCRATCH)

    def place(self, displacement: np.ndarray, rotation: np.ndarray | None = None) -> None:
        """Set displacements and rotation vectors from the start, (n, 3) each."""
        self.nodes.position[:, : self.n] = (self.start + displacement).T
        self.nodes.rotation[:, : self.n] = quaternion(np.zeros_like(self.start) if rotation is None else rotation).T

    def forces(self, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Forces [N] and moments [N mm] of the shells on the nodes, (n, 3) each."""
        self.nodes.force[:], self.nodes.moment[:] = 0.0, 0.0
        eroded, rubbed = shell_forces(0, self.blocks, time, self.nodes, self.shells, self.laminate, self.scratch)
        self.eroded += eroded
        self.friction_losses += rubbed
        gather_shells(0, self.n, self.nodes, self.shells)
        return self.nodes.force[:, : self.n].T.copy(), self.nodes.moment[:, : self.n].T.copy()

    def tangent(self, displacement: np.ndarray | float = 0.0, step: float = 1e-6) -> np.ndarray:
        """Stiffness (6 n, 6 n) of all nodes about a ``displacement`` (n, 3), by central differences of the forces."""
        found, moves = [], np.eye(6 * self.n) * step
        for move in moves:
            sides = []
            for u in (move.reshape(-1, 6), -move.reshape(-1, 6)):
                self.place(displacement + u[:, :3], u[:, 3:])
                sides.append(np.hstack(self.forces()).ravel())
            found.append((sides[1] - sides[0]) / (2.0 * step))
        return np.array(found).T

    def energy(self) -> float:
        """Elastic energy with that of the hourglass control [mJ]."""
        return sum(shell_energies(self.nodes, self.shells, self.laminate))


def quaternion(vector: np.ndarray) -> np.ndarray:
    """Unit quaternions (n, 4) of rotation vectors (n, 3)."""
    angle = np.linalg.norm(vector, axis=1, keepdims=True)
    return np.hstack([np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * vector])


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Hamilton product."""
    vector = p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *vector])


def solve(solid: Solid, free: np.ndarray, start: np.ndarray, load: np.ndarray, steps: int = 1) -> np.ndarray:
    """Static state (n, 6) by Newton's method: free degrees of freedom (n, 6) from ``start`` under ``load``."""
    u = start.copy()

    def residual(v: np.ndarray, share: float) -> np.ndarray:
        solid.place(v[:, :3], v[:, 3:])
        return (np.hstack(solid.forces()) + share * load)[free]

    index = np.argwhere(free)
    for step in range(1, steps + 1):
        for _ in range(30):
            r = residual(u, step / steps)
            tangent = np.empty((len(index), len(index)))
            for k, (i, j) in enumerate(index):
                for sign in (1.0, -1.0):
                    u[i, j] += sign * 1e-6
                    part = residual(u, step / steps) / (2e-6 * sign)
                    tangent[:, k] = part if sign > 0 else tangent[:, k] + part
                    u[i, j] -= sign * 1e-6
            change = np.linalg.solve(tangent, -r)
            u[free] += change
            if np.abs(change).max() < 1e-9:
                break
        else:
            raise AssertionError("no equilibrium found")
    solid.place(u[:, :3], u[:, 3:])
    return u


def grid(nx: int, ny: int, lx: float, ly: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 3), row by row along y, and quadrilaterals of a rectangle."""
    x, y = np.meshgrid(np.linspace(0.0, lx, nx + 1), np.linspace(0.0, ly, ny + 1), indexing="ij")
    corner = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)).ravel()
    conn = np.column_stack([corner, corner + ny + 1, corner + ny + 2, corner + 1])
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), conn


def wavy(seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """A distorted, warped mesh of 4 x 3 elements of about 5 mm."""
    position, conn = grid(4, 3, 20.0, 15.0)
    return position + np.random.default_rng(seed).normal(0.0, 0.4, position.shape), conn


def descents(solid: Solid, h: float = 1e-5) -> tuple[np.ndarray, np.ndarray]:
    """Negative gradients of the energy by central differences of ``h`` [mm, rad]: forces and moments, (n, 3) each."""
    force, moment = np.zeros((solid.n, 3)), np.zeros((solid.n, 3))
    for i in range(solid.n):
        for axis in range(3):
            before = solid.nodes.rotation[:, i].copy()
            for step in (h, -h):
                solid.nodes.position[axis, i] += step
                force[i, axis] -= solid.energy() / (2.0 * step)
                solid.nodes.position[axis, i] -= step
                solid.nodes.rotation[:, i] = product(quaternion(step * np.eye(3)[axis : axis + 1])[0], before)
                moment[i, axis] -= solid.energy() / (2.0 * step)
                solid.nodes.rotation[:, i] = before
    return force, moment
