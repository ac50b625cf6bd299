"""The public names, with types. Written by python -m docs.generate: do not edit."""

import collections.abc
import os
import typing

import knittest.api.fabric
import knittest.api.run
from knittest import errors as errors
from knittest import pose as pose
from knittest.api.fabric import Fabric as Fabric
from knittest.api.run import Gates as Gates
from knittest.api.run import QualityChecks as QualityChecks
from knittest.api.run import Run as Run
from knittest.api.run import Runs as Runs
from knittest.api.run import load as load
from knittest.api.studies import Study as Study
from knittest.api.studies import batch as batch
from knittest.api.studies import calibrate as calibrate
from knittest.api.studies import homogenise as homogenise
from knittest.api.studies import uncertainty as uncertainty
from knittest.api.tests import resume as resume
from knittest.api.tests import run_test as run_test
from knittest.base.errors import InputError as InputError

__version__: str

def bias_extension(
    fabric: str | int | os.PathLike[str] | knittest.api.fabric.Fabric | None = None,
    *,
    scale: str | None = None,
    preset: str | None = None,
    parameters: str | None = None,
    specimens: int | None = None,
    seed: int | None = None,
    set: collections.abc.Mapping[str, typing.Any] | collections.abc.Sequence[str] = (),
    config: os.PathLike[str] | str | None = None,
    out: os.PathLike[str] | str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    frames: bool = True,
    pictures: bool = True,
    verify: bool = False,
    accept_limits: bool = False,
    against: os.PathLike[str] | str | collections.abc.Sequence[os.PathLike[str] | str] = (),
) -> knittest.api.run.Run | knittest.api.run.Runs:
    """Pull of a strip cut at 45 deg to its yarns, macro or meso."""

def biaxial(
    fabric: str | int | os.PathLike[str] | knittest.api.fabric.Fabric | None = None,
    *,
    scale: str | None = None,
    preset: str | None = None,
    direction: str | None = None,
    parameters: str | None = None,
    specimens: int | None = None,
    seed: int | None = None,
    set: collections.abc.Mapping[str, typing.Any] | collections.abc.Sequence[str] = (),
    config: os.PathLike[str] | str | None = None,
    out: os.PathLike[str] | str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    frames: bool = True,
    pictures: bool = True,
    verify: bool = False,
    accept_limits: bool = False,
    against: os.PathLike[str] | str | collections.abc.Sequence[os.PathLike[str] | str] = (),
    ratio: float | None = None,
) -> knittest.api.run.Run | knittest.api.run.Runs:
    """Pull along warp and weft at once, macro or meso."""

def cantilever(
    fabric: str | int | os.PathLike[str] | knittest.api.fabric.Fabric | None = None,
    *,
    scale: str | None = None,
    preset: str | None = None,
    direction: str | None = None,
    parameters: str | None = None,
    specimens: int | None = None,
    seed: int | None = None,
    set: collections.abc.Mapping[str, typing.Any] | collections.abc.Sequence[str] = (),
    config: os.PathLike[str] | str | None = None,
    out: os.PathLike[str] | str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    frames: bool = True,
    pictures: bool = True,
    verify: bool = False,
    accept_limits: bool = False,
    against: os.PathLike[str] | str | collections.abc.Sequence[os.PathLike[str] | str] = (),
) -> knittest.api.run.Run | knittest.api.run.Runs:
    """Bending under its own weight, macro or meso."""

def cell(
    fabric: str | int | os.PathLike[str] | knittest.api.fabric.Fabric | None = None,
    *,
    scale: str | None = None,
    preset: str | None = None,
    parameters: str | None = None,
    specimens: int | None = None,
    seed: int | None = None,
    set: collections.abc.Mapping[str, typing.Any] | collections.abc.Sequence[str] = (),
    config: os.PathLike[str] | str | None = None,
    out: os.PathLike[str] | str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    frames: bool = True,
    pictures: bool = True,
    verify: bool = False,
    accept_limits: bool = False,
    against: os.PathLike[str] | str | collections.abc.Sequence[os.PathLike[str] | str] = (),
    path: str | None = None,
) -> knittest.api.run.Run | knittest.api.run.Runs:
    """One periodic cell of yarns under a mean deformation, meso."""

def compaction(
    fabric: str | int | os.PathLike[str] | knittest.api.fabric.Fabric | None = None,
    *,
    scale: str | None = None,
    preset: str | None = None,
    parameters: str | None = None,
    specimens: int | None = None,
    seed: int | None = None,
    set: collections.abc.Mapping[str, typing.Any] | collections.abc.Sequence[str] = (),
    config: os.PathLike[str] | str | None = None,
    out: os.PathLike[str] | str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    frames: bool = True,
    pictures: bool = True,
    verify: bool = False,
    accept_limits: bool = False,
    against: os.PathLike[str] | str | collections.abc.Sequence[os.PathLike[str] | str] = (),
) -> knittest.api.run.Run | knittest.api.run.Runs:
    """Compaction between two plates, meso."""

def forming(
    fabric: str | int | os.PathLike[str] | knittest.api.fabric.Fabric | None = None,
    *,
    scale: str | None = None,
    preset: str | None = None,
    parameters: str | None = None,
    specimens: int | None = None,
    seed: int | None = None,
    set: collections.abc.Mapping[str, typing.Any] | collections.abc.Sequence[str] = (),
    config: os.PathLike[str] | str | None = None,
    out: os.PathLike[str] | str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    frames: bool = True,
    pictures: bool = True,
    verify: bool = False,
    accept_limits: bool = False,
    against: os.PathLike[str] | str | collections.abc.Sequence[os.PathLike[str] | str] = (),
    blank_holder_force: float | None = None,
) -> knittest.api.run.Run | knittest.api.run.Runs:
    """Form a blank with stamp and die, macro or meso."""

def friction(
    fabric: str | int | os.PathLike[str] | knittest.api.fabric.Fabric | None = None,
    *,
    scale: str | None = None,
    preset: str | None = None,
    direction: str | None = None,
    parameters: str | None = None,
    specimens: int | None = None,
    seed: int | None = None,
    set: collections.abc.Mapping[str, typing.Any] | collections.abc.Sequence[str] = (),
    config: os.PathLike[str] | str | None = None,
    out: os.PathLike[str] | str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    frames: bool = True,
    pictures: bool = True,
    verify: bool = False,
    accept_limits: bool = False,
    against: os.PathLike[str] | str | collections.abc.Sequence[os.PathLike[str] | str] = (),
) -> knittest.api.run.Run | knittest.api.run.Runs:
    """Pull-out between two plates, macro or meso."""

def picture_frame(
    fabric: str | int | os.PathLike[str] | knittest.api.fabric.Fabric | None = None,
    *,
    scale: str | None = None,
    preset: str | None = None,
    parameters: str | None = None,
    specimens: int | None = None,
    seed: int | None = None,
    set: collections.abc.Mapping[str, typing.Any] | collections.abc.Sequence[str] = (),
    config: os.PathLike[str] | str | None = None,
    out: os.PathLike[str] | str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    frames: bool = True,
    pictures: bool = True,
    verify: bool = False,
    accept_limits: bool = False,
    against: os.PathLike[str] | str | collections.abc.Sequence[os.PathLike[str] | str] = (),
) -> knittest.api.run.Run | knittest.api.run.Runs:
    """Shear in a hinged frame, macro or meso."""

def pull_out(
    fabric: str | int | os.PathLike[str] | knittest.api.fabric.Fabric | None = None,
    *,
    scale: str | None = None,
    preset: str | None = None,
    direction: str | None = None,
    parameters: str | None = None,
    specimens: int | None = None,
    seed: int | None = None,
    set: collections.abc.Mapping[str, typing.Any] | collections.abc.Sequence[str] = (),
    config: os.PathLike[str] | str | None = None,
    out: os.PathLike[str] | str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    frames: bool = True,
    pictures: bool = True,
    verify: bool = False,
    accept_limits: bool = False,
    against: os.PathLike[str] | str | collections.abc.Sequence[os.PathLike[str] | str] = (),
) -> knittest.api.run.Run | knittest.api.run.Runs:
    """Pull of one inlay out of the fabric, meso."""

def tensile(
    fabric: str | int | os.PathLike[str] | knittest.api.fabric.Fabric | None = None,
    *,
    scale: str | None = None,
    preset: str | None = None,
    direction: str | None = None,
    parameters: str | None = None,
    specimens: int | None = None,
    seed: int | None = None,
    set: collections.abc.Mapping[str, typing.Any] | collections.abc.Sequence[str] = (),
    config: os.PathLike[str] | str | None = None,
    out: os.PathLike[str] | str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    frames: bool = True,
    pictures: bool = True,
    verify: bool = False,
    accept_limits: bool = False,
    against: os.PathLike[str] | str | collections.abc.Sequence[os.PathLike[str] | str] = (),
) -> knittest.api.run.Run | knittest.api.run.Runs:
    """Strip tensile test to failure, macro or meso."""
