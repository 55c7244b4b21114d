"""A multilayer perceptron in plain NumPy: products, sums, and ReLU.

Its files are NumPy archives (`.npz`) with `weight_0` (m, n), `bias_0` (m,), `weight_1`
and so on, in float32.
"""

import io
import zipfile
from itertools import count, pairwise, takewhile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array
from beacon_mj.regular_files import read_regular

MAX_BYTES = 4_000_000  #: Of a file.
Layer = tuple[Array, Array]


class Network:
    """y = W_k relu(... relu(W_0 x + b_0) ...) + b_k.

    Attributes:
        layers: Weights (m, n) and biases (m,) of each layer.
    """

    def __init__(self, layers: list[Layer]) -> None:
        """Take the layers, the first one first."""
        self.layers = layers

    def __call__(self, x: Array) -> Array:
        """Return the output for an input of shape (n,)."""
        for k, (weight, bias) in enumerate(self.layers):
            x = np.maximum(x, 0.0) if k else x
            x = (weight * x).sum(axis=1) + bias
        return x


def load_network(path: str | Path, inputs: int, outputs: int) -> Network:
    """Return the network of a file.

    Raises:
        PlannerError: If the file is no such network, or not of these sizes.
    """
    try:
        with np.load(io.BytesIO(read_regular(path, MAX_BYTES))) as arrays:
            layers = _layers({name: arrays[name] for name in arrays.files})
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise PlannerError(
            f"{path}: expected a network's weights (.npz) but it cannot be read: "
            f"{error}."
        ) from error
    widths = [inputs, *(len(bias) for _, bias in layers)]
    shapes = [weight.shape for weight, _ in layers]
    if shapes != [(m, n) for n, m in pairwise(widths)] or widths[-1] != outputs:
        raise PlannerError(
            f"{path}: expected layers from {inputs} inputs to {outputs} outputs but "
            f"their shapes were {shapes}."
        )
    return Network(layers)


def _layers(arrays: dict[str, NDArray[np.float32]]) -> list[Layer]:
    """Return the layers of an archive, in double precision."""
    names = takewhile(lambda k: f"weight_{k}" in arrays, count())
    pairs = ((arrays[f"weight_{k}"], arrays[f"bias_{k}"]) for k in names)
    return [(w.astype(np.float64), b.astype(np.float64)) for w, b in pairs]
