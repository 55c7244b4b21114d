"""Read a log with any MCAP reader, and plot the force on the bumper.

Usage: python examples/read_log.py
"""

import math
from collections.abc import Iterator
from pathlib import Path

from matplotlib import pyplot as plt
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

import beacon_mj as bmj


def forces(path: Path) -> Iterator[tuple[float, float]]:
    """Yield time [s] and force on the bumper [N] of each control step."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, _, message, step in reader.iter_decoded_messages(["/step"]):
            force = math.hypot(step.bumper_force_n.x, step.bumper_force_n.y)
            yield message.log_time * 1e-9, force


if __name__ == "__main__":
    results = bmj.evaluate(
        ["beacon"],
        families=["collision-required"],
        scenes_per_family=1,
        workers=1,
        out="runs/logged",
    )
    found = [*forces(results.log("beacon", "collision-required", 0))]
    times_s, forces_n = [time for time, _ in found], [force for _, force in found]
    figure, axes = plt.subplots()
    axes.plot(times_s, forces_n)
    axes.set(xlabel="time [s]", ylabel="force on the bumper [N]")
    figure.savefig("force.png")
    print(f"{len(times_s)} steps, at most {max(forces_n):.1f} N: force.png")
