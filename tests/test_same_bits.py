"""No scene, decision, physics, row or log rests on arithmetic that a CPU chooses.

The rules are those of `docs/same-rows.md`. What may stand nevertheless is listed in
`ALLOWED`, each with its reason; an entry that nothing needs any more is a failure too.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.repository import REPOSITORY

#: Folders on whose code a scene, a decision, the physics, a row or a log depends, and
#: the modules beside them. Pictures, reports and statistics are not among them.
FOLDERS = (
    "beacon_mj/episode",
    "beacon_mj/learning",
    "beacon_mj/motion",
    "beacon_mj/recording",
    "beacon_mj/scene",
    "beacon_mj/world",
    "eval/metrics",
    "planners",
    "scene_gen",
)
#: NumPy functions of BLAS or LAPACK, and such as differ with libm or the CPU's SIMD.
NUMPY = frozenset(
    "dot vdot vecdot matvec vecmat inner outer matmul einsum einsum_path tensordot "
    "kron convolve correlate cov corrcoef polyfit polyval roots vander linalg fft "
    "sin cos tan arcsin arccos arctan arctan2 asin acos atan atan2 sinh cosh tanh "
    "arcsinh arccosh arctanh sinc angle unwrap exp exp2 expm1 log log2 log10 log1p "
    "logaddexp logaddexp2 logspace geomspace power pow float_power cbrt hypot".split()
)
#: What may be taken from `math`: exact, correctly rounded, or libm's scalar functions.
MATH = frozenset(
    "acos asin atan atan2 ceil comb copysign cos degrees e exp fabs floor fmod fsum "
    "gcd inf isclose isfinite isinf isnan isqrt lcm log nan nextafter pi prod radians "
    "sin sqrt tan tau trunc ulp".split()
)
#: Of these, what compiled code may call: numba may give the others to SVML.
KERNEL_MATH = frozenset("ceil copysign fabs floor inf isinf isnan pi sqrt".split())
#: Reductions that compiled code adds in another order than NumPy does.
REDUCTIONS = frozenset("sum mean prod std var nansum".split())
#: Sorts of which NumPy has versions for AVX2 and AVX-512; ties come in another order.
SORTS = frozenset("argsort argpartition".split())
_COUNTS = "a sum of whole numbers"
_QHULL = "Qhull is compiled for SSE2 and chooses nothing by the CPU"
_ERFC = "libm's scalar function, in a chance that is compared and logged"
_INFO = "r.command.info"
#: (file, expression): why it may stand.
ALLOWED = {
    ("eval/metrics/measure.py", f"sum(({_INFO}.replanned for r in trace.steps))"): (
        _COUNTS
    ),
    ("eval/metrics/measure.py", f"sum(({_INFO}.expansions for r in trace.steps))"): (
        _COUNTS
    ),
    ("scene_gen/generate.py", "sum(reasons.values())"): _COUNTS,
    ("beacon_mj/recording/finalize.py", "sum(self._counts.values())"): _COUNTS,
    ("beacon_mj/scene/shapes.py", "from scipy.spatial import ConvexHull, QhullError"): (
        _QHULL
    ),
    ("scene_gen/geom_points.py", "from scipy.spatial import ConvexHull, QhullError"): (
        _QHULL
    ),
    ("scene_gen/limited_reader.py", "import scipy.spatial"): _QHULL,
    ("planners/contact/force_scale.py", "math.erfc"): _ERFC,
    ("scene_gen/learning/latents.py", "math.erfc"): (
        "libm's scalar function, in a chance that is rounded to 12 places"
    ),
    (
        "beacon_mj/motion/expansions.py",
        "sum((search.expansions for search in self._searches))",
    ): _COUNTS,
    (
        "eval/metrics/contact_metrics.py",
        "sum((len(record.outcome.own_attempts) for record in trace.steps))",
    ): _COUNTS,
    ("beacon_mj/recording/machine.py", "from numba.core import config"): (
        "names the CPU that kernels are compiled for"
    ),
    ("beacon_mj/jit.py", "import numba"): "the one place where kernels are compiled",
}


def sources() -> list[Path]:
    found = [*(REPOSITORY / "beacon_mj").glob("*.py")]
    for folder in FOLDERS:
        found += (REPOSITORY / folder).rglob("*.py")
    return sorted(p for p in found if not p.name.startswith("__"))


def faults(source: str) -> Iterator[tuple[int, str]]:
    """Yield (line, expression) of all that breaks a rule."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if _breaks_a_rule(node):
            yield node.lineno, ast.unparse(node)  # type: ignore[attr-defined]
        if isinstance(node, ast.FunctionDef) and _is_compiled(node):
            for inner in ast.walk(node):
                if _breaks_a_kernels_rule(inner):
                    yield inner.lineno, ast.unparse(inner)  # type: ignore[attr-defined]


def _breaks_a_rule(node: ast.AST) -> bool:
    match node:
        case ast.BinOp(op=ast.MatMult()) | ast.AugAssign(op=ast.MatMult()):
            return True
        case ast.BinOp(ast.Constant(int()), ast.Pow(), ast.Constant(int())):
            return False  # A whole number, such as 10**6.
        case ast.BinOp(op=ast.Pow()) | ast.AugAssign(op=ast.Pow()):
            return True
        case ast.Attribute(ast.Name("np" | "numpy"), name) if name in NUMPY:
            return True
        case ast.Attribute(ast.Name("math"), name):
            return name not in MATH
        case ast.Attribute(attr="dot" | "linalg"):
            return True
        case ast.Call(ast.Attribute(attr=name), keywords=keywords) if name in SORTS:
            return not any(ast.unparse(k) == "kind='stable'" for k in keywords)
        case ast.Call(ast.Name("sum"), [ast.GeneratorExp(elt=elt)]):
            return not isinstance(elt, ast.Compare | ast.BoolOp)  # Counting is exact.
        case ast.Call(ast.Name("sum" | "pow" | "complex")):
            return True
        case ast.keyword("fastmath"):
            return True
        case ast.Import(names):
            return any(_is_suspect(alias.name) for alias in names)
        case ast.ImportFrom(module=str(module), names=names):
            return (
                module == "math"
                or _is_suspect(module)
                or (module == "numpy" and any(a.name in NUMPY for a in names))
            )
    return False


def _is_suspect(module: str) -> bool:
    return module.split(".")[0] in ("cmath", "statistics", "scipy", "numba") or (
        module.startswith(("numpy.linalg", "numpy.fft", "numpy.polynomial"))
    )


def _is_compiled(function: ast.FunctionDef) -> bool:
    names = {ast.unparse(d).split("(")[0] for d in function.decorator_list}
    return bool(names & {"kernel", "inlined"})


def _breaks_a_kernels_rule(node: ast.AST) -> bool:
    match node:
        case ast.Attribute(ast.Name("math"), name):
            return name in MATH - KERNEL_MATH
        case ast.Call(ast.Attribute(attr=name)) if name in REDUCTIONS:
            return True
    return False


@pytest.mark.parametrize(
    "path", sources(), ids=lambda p: str(p.relative_to(REPOSITORY))
)
def test_no_arithmetic_that_the_cpu_chooses(path: Path) -> None:
    name = path.relative_to(REPOSITORY).as_posix()
    found = [
        f"{name}:{line}: {expression}"
        for line, expression in faults(path.read_text())
        if (name, expression) not in ALLOWED
    ]
    assert found == [], "see docs/same-rows.md and beacon_mj/numerics.py"


def test_every_exception_is_still_needed() -> None:
    found = {
        (path.relative_to(REPOSITORY).as_posix(), expression)
        for path in sources()
        for _, expression in faults(path.read_text())
    }
    assert set(ALLOWED) - found == set()


def test_the_folders_are_those_that_rows_depend_on() -> None:
    names = {path.relative_to(REPOSITORY).as_posix() for path in sources()}
    assert {
        "beacon_mj/geometry.py",
        "beacon_mj/motion/grid.py",
        "beacon_mj/world/drive.py",
        "eval/metrics/measure.py",
        "planners/contact/controller.py",
        "scene_gen/generate.py",
    } <= names


@pytest.mark.parametrize(
    "line",
    [
        "a @ b",
        "a @= b",
        "a ** 2",
        "a **= 2",
        "2.0 ** k",
        "np.cos(a)",
        "np.linalg.norm(a)",
        "np.hypot(x, y)",
        "np.einsum('ij,j', a, b)",
        "a.dot(b)",
        "math.hypot(x, y)",
        "math.dist(a, b)",
        "math.pow(a, 0.5)",
        "math.sumprod(a, b)",
        "sum(costs)",
        "sum(x * y for x, y in pairs)",
        "pow(a, 2)",
        "a.argsort()",
        "np.argsort(a, kind='quicksort')",
        "njit(fastmath=True)(f)",
        "from math import hypot",
        "from numpy import sin",
        "from scipy.optimize import minimize",
        "import numba",
        "import statistics",
        "@kernel\ndef f(x): return math.sin(x)",
        "@kernel\ndef f(a): return a.sum()",
        "@inlined\ndef f(a): return np.mean(a)",
    ],
)
def test_faults_are_found(line: str) -> None:
    assert len([*faults(line)]) >= 1


@pytest.mark.parametrize(
    "line",
    [
        "10**6",
        "np.sqrt(x * x + y * y).sum()",
        "math.sin(x) + math.fsum(terms)",
        "sum(x > 0.0 for x in costs)",
        "np.argsort(a, kind='stable')",
        "from numpy.typing import NDArray",
        "@kernel\ndef f(x): return math.sqrt(x)",
    ],
)
def test_what_every_cpu_does_alike_is_no_fault(line: str) -> None:
    assert [*faults(line)] == []
