"""CasADi's expression graph of one element, printed as Python source."""

from __future__ import annotations

from typing import Protocol

from gso.errors import BackendError


class Graph(Protocol):
    """The ``casadi.Function`` of one element; CasADi's own type stubs are wrong about overloads."""

    def n_instructions(self) -> int: ...
    def instruction_id(self, k: int, /) -> int: ...
    def instruction_input(self, k: int, /) -> list[int]: ...
    def instruction_output(self, k: int, /) -> list[int]: ...
    def instruction_constant(self, k: int, /) -> float: ...
    def n_out(self) -> int: ...
    def nnz_out(self, k: int, /) -> int: ...
    def size1_in(self, k: int, /) -> int: ...
    def size1_out(self, k: int, /) -> int: ...
    def sz_w(self) -> int: ...


class Style(Protocol):
    """How the steps of a graph are written."""

    def given(self, array: str, index: int) -> str:
        """Return the operand for an entry of the coordinates "x" or of the constants "c"."""

    def slot(self, index: int) -> str:
        """Return the operand for a work slot."""

    def step(self, name: str, slot: int, operands: list[str]) -> str:
        """Return the statement that puts the result of a NumPy ufunc into a slot."""

    def store(self, output: int, index: int, operand: str) -> str:
        """Return the statement that stores an entry of an output."""


def print_graph(function: Graph, style: Style) -> list[str]:
    """Return the statements of a CasADi function, one after the other."""
    import casadi as ca

    ufuncs = {
        ca.OP_ADD: "add",
        ca.OP_SUB: "subtract",
        ca.OP_MUL: "multiply",
        ca.OP_DIV: "divide",
        ca.OP_NEG: "negative",
        ca.OP_SQ: "square",
        ca.OP_SQRT: "sqrt",
        ca.OP_ATAN2: "arctan2",
        ca.OP_FMIN: "minimum",
        ca.OP_FMAX: "maximum",
        ca.OP_INV: "reciprocal",
        ca.OP_FABS: "absolute",
        ca.OP_LT: "less",
        ca.OP_LE: "less_equal",
        ca.OP_EQ: "equal",
        ca.OP_NE: "not_equal",
        ca.OP_NOT: "logical_not",
        ca.OP_AND: "logical_and",
        ca.OP_OR: "logical_or",
        ca.OP_SIGN: "sign",
    }
    lines: list[str] = []
    # CasADi reuses work slots. Inputs and constants are read in place, not through a slot, so
    # that one that is read late is not overwritten.
    direct: dict[int, str] = {}

    def operand(slot: int) -> str:
        return direct.get(slot, style.slot(slot))

    written = set()
    for i in range(function.n_instructions()):
        op = function.instruction_id(i)
        args, out = function.instruction_input(i), function.instruction_output(i)
        if op == ca.OP_INPUT:
            direct[out[0]] = style.given("xc"[args[0]], args[1])
        elif op == ca.OP_CONST:
            direct[out[0]] = repr(float(function.instruction_constant(i)))
        elif op == ca.OP_OUTPUT:
            lines.append(style.store(out[0], out[1], operand(args[0])))
            written.add((out[0], out[1]))
        elif op == ca.OP_TWICE:
            lines.append(style.step("add", out[0], 2 * [operand(args[0])]))
            direct.pop(out[0], None)
        elif op in ufuncs:
            lines.append(style.step(ufuncs[op], out[0], [operand(a) for a in args]))
            direct.pop(out[0], None)
        else:
            raise BackendError(
                f"a residual uses CasADi operation {op}, which kernels cannot print; "
                "write it with + - * / and gso.geometry.ops"
            )
    # Entries that are structurally zero are never visited.
    for output in range(function.n_out()):
        for index in range(function.nnz_out(output)):
            if (output, index) not in written:
                lines.append(style.store(output, index, "0.0"))
    return lines


class _Rows:
    """Operands that are rows of arrays or tensors."""

    def given(self, array: str, index: int) -> str:
        return f"{array}[{index}]"

    def slot(self, index: int) -> str:
        return f"w[{index}]"


class _Arrays(_Rows):
    """Statements on arrays of elements."""

    def step(self, name: str, slot: int, operands: list[str]) -> str:
        said = ", ".join(operands)
        if not any(text.startswith(("w[", "x[", "c[")) for text in operands):
            return f"w[{slot}][...] = np.{name}({said})"
        return f"np.{name}({said}, out=w[{slot}], casting='unsafe')"

    def store(self, output: int, index: int, operand: str) -> str:
        return f"{'rJ'[output]}[{index}] = {operand}"


def numpy_source(function: Graph) -> str:
    """Return the source of ``kernel(x, c, r, J, w)``, on arrays of elements."""
    lines = print_graph(function, _Arrays())
    return "def kernel(x, c, r, J, w):\n" + "".join(f"    {line}\n" for line in lines or ["pass"])


class _Tensors(_Rows):
    """Statements on PyTorch tensors; numbers in the graph become tensors, by their values."""

    def __init__(self) -> None:
        self.numbers: dict[str, str] = {}

    def _tensor(self, operand: str) -> str:
        if operand.endswith("]"):
            return operand
        return self.numbers.setdefault(operand, f"k[{len(self.numbers)}]")

    def step(self, name: str, slot: int, operands: list[str]) -> str:
        said = ", ".join(map(self._tensor, operands))
        return f"torch.{_TORCH.get(name, name)}({said}, out=w[{slot}])"

    def store(self, output: int, index: int, operand: str) -> str:
        return f"{'rJ'[output]}[{index}].copy_({self._tensor(operand)})"


#: PyTorch's names of NumPy's ufuncs, where they differ.
_TORCH = {"equal": "eq"}


def torch_source(function: Graph) -> tuple[str, list[float]]:
    """Return the source of ``kernel(x, c, r, J, w, k)`` on tensors, and the numbers k it needs.

    x, c, r, J, w and k are sequences of tensors: coordinates, constants, residuals, entries of
    the Jacobian, work slots, and numbers without dimensions.
    """
    style = _Tensors()
    lines = print_graph(function, style)
    body = "".join(f"    {line}\n" for line in lines or ["pass"])
    return "def kernel(x, c, r, J, w, k):\n" + body, [float(text) for text in style.numbers]


_SCALAR = {
    "add": "{0} + {1}",
    "subtract": "{0} - {1}",
    "multiply": "{0} * {1}",
    "divide": "{0} / {1}",
    "negative": "-{0}",
    "arctan2": "arctan2({0}, {1})",
    "square": "{0} * {0}",
    "reciprocal": "1.0 / {0}",
    "less": "1.0 if {0} < {1} else 0.0",
    "less_equal": "1.0 if {0} <= {1} else 0.0",
    "equal": "1.0 if {0} == {1} else 0.0",
    "not_equal": "1.0 if {0} != {1} else 0.0",
    "logical_not": "1.0 if {0} == 0.0 else 0.0",
    "logical_and": "1.0 if {0} != 0.0 and {1} != 0.0 else 0.0",
    "logical_or": "1.0 if {0} != 0.0 or {1} != 0.0 else 0.0",
}


class _Scalars:
    """Statements on the numbers of one element, the t-th of a tile."""

    def __init__(self) -> None:
        self.used: dict[str, str] = {}
        self.stored: list[tuple[int, int]] = []

    def given(self, array: str, index: int) -> str:
        return self.used.setdefault(f"t{array}[{index}, t]", f"{array}{index}")

    def slot(self, index: int) -> str:
        return f"w{index}"

    def step(self, name: str, slot: int, operands: list[str]) -> str:
        # Numbers are bracketed because of their sign.
        said = [f"({text})" if text.startswith("-") else text for text in operands]
        form = _SCALAR.get(name, f"np.{name}({', '.join(said)})")
        return f"w{slot} = {form.format(*said)}"

    def store(self, output: int, index: int, operand: str) -> str:
        self.stored.append((output, index))
        return f"out[{len(self.stored) - 1}, t] = {operand}"


#: Elements per tile of a compiled loop.
_TILE = 32

_LOOP = """
def kernel(p, gather, c, start, stop, r, J):
    tx, tc = np.empty(({coordinates}, {tile})), np.empty(({constants}, {tile}))
    out = np.empty(({outputs}, {tile}))
    for first in range(start, stop, {tile}):
        count = min({tile}, stop - first)
        for k in range({coordinates}):
            for t in range({tile}):
                tx[k, t] = p[gather[k, first + min(t, count - 1)]]
        for k in range({constants}):
            for t in range({tile}):
                tc[k, t] = c[k, first + min(t, count - 1)]
        for t in range({tile}):
{body}
        for t in range(count):
{stores}
"""


def loop_source(function: Graph) -> str:
    """Return the source of ``kernel(p, gather, c, start, stop, r, J)``, a loop over elements.

    p : coordinates; gather : (k, e) numbers of them; c : constants (c, e); r : residuals (r, e);
    J : Jacobians (stop - start, r * k) of the elements from `start` on.

    The elements are evaluated in tiles. Inputs and outputs of a tile are copied, so that nothing
    keeps the compiler from using vector instructions.
    """
    style = _Scalars()
    lines = print_graph(function, style)
    loads = [f"{name} = {place}" for place, name in style.used.items()]
    places = ["r[{0}, first + t]", "J[first + t - start, {0}]"]
    stores = [
        f"{places[output].format(index)} = out[{k}, t]"
        for k, (output, index) in enumerate(style.stored)
    ]
    body, ends = (
        "\n".join(f"{12 * ' '}{line}" for line in some or ["pass"])
        for some in ([*loads, *lines], sorted(stores))
    )
    return _LOOP.format(
        tile=_TILE,
        coordinates=function.size1_in(0),
        constants=function.size1_in(1),
        outputs=len(style.stored),
        body=body,
        stores=ends,
    ).lstrip()
