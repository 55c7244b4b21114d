"""Imported by the server that runs are forked from: all that takes time at first."""

import beacon_mj.eval.api.evaluation  # noqa: F401
from beacon_mj.eval.runs.warm_up import compile_kernels, load_kernels

compile_kernels()
load_kernels()
