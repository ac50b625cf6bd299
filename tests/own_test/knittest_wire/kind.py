"""Record of the wire."""

from knittest.base.kinds import TestKind

KIND = TestKind(
    name="wire",
    summary="A wire between two grips.",
    usage="""Pull a wire of a given axial stiffness: force and stiffness.

    Example: knittest wire --variant 1 --max-strain 0.5
    """,
    directional=False,
    shortcuts={"max-strain": ("rig.max_strain", "Largest strain [%].")},
    run="knittest_wire.config:WireRun",
    test="knittest_wire.test:WireTest",
    report="knittest_wire.report:WireReport",
    labels={"end_force_n": ("force at the end [N]", "{:.3f}"), "stiffness_n": ("EA of the wire [N]", "{:.2f}")},
    pictures=("curve.png", "energies.png"),
    tables=("elements.csv",),
    presets="knittest_wire.config:settings",
    sizes=("length",),
)
