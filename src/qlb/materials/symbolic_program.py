"""From SymPy expressions to the lists of operations that the element kernels run (native/materials/program.hpp)."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import sympy

from qlb import _native
from qlb.arrays import FloatArray, IntArray
from qlb.errors import InputError
from qlb.materials.symbolic_density import FUNCTIONS, INVARIANTS, Density, Direction, Magnitude

_CODES = {name: code for code, (name, _) in enumerate(_native.program_operations())}


class OperationList(NamedTuple):
    """One list, as `_native.Program` takes it.

    Attributes:
        operations: codes, shape (k,).
        registers: target and three operands of each, shape (k, 4).
        constants: what fills the registers after the invariants and the parameters.
        outputs: registers of the results.
    """

    operations: IntArray
    registers: IntArray
    constants: FloatArray
    outputs: IntArray


def compile_density(density: Density) -> tuple[OperationList, OperationList, OperationList]:
    """Lists for psi; for psi with its first derivatives; for all first and second derivatives.

    Raises:
        InputError: psi takes more registers or operations than there are.
    """
    return (
        _compile((density.psi,), density.parameters),
        _compile((density.psi, *density.first), density.parameters),
        _compile((*density.first, *density.second), density.parameters),
    )


def _compile(expressions: Sequence[Any], parameters: Sequence[Any]) -> OperationList:
    graph = _Graph([*INVARIANTS, *parameters], expressions)
    graph.fuse()
    return graph.allocate()


class _Node(NamedTuple):
    """A value: `name` applied to earlier values; or a "given" register, or a "constant", which `value` tells."""

    name: str
    operands: tuple[int, ...] = ()
    value: float = 0.0


class _Graph:
    """The values that expressions need, each computed once, in an order in which they can be computed."""

    def __init__(self, given: Sequence[Any], expressions: Sequence[Any]) -> None:
        self.nodes: list[_Node] = []
        self.given = len(given)
        self._index: dict[_Node, int] = {}
        self._known: dict[Any, int] = {s: self._add(_Node("given", value=k)) for k, s in enumerate(given)}
        shared, reduced = sympy.cse(expressions, symbols=sympy.numbered_symbols(cls=sympy.Dummy))
        self._shared = dict(shared)
        self.outputs = [self._value(expression) for expression in reduced]

    def _add(self, node: _Node) -> int:
        if node not in self._index:
            self._index[node] = len(self.nodes)
            self.nodes.append(node)
        return self._index[node]

    def _emit(self, name: str, *operands: int) -> int:
        return self._add(_Node(name, operands))

    def _constant(self, value: float) -> int:
        if not np.isfinite(value):
            raise InputError(f"psi has the constant {value:g} in a derivative: constants must be finite")
        return self._add(_Node("constant", value=float(value)))

    def _value(self, e: Any) -> int:
        """The value of an expression; a shared one is computed where it is first needed."""
        if e not in self._known:
            self._known[e] = self._value(self._shared[e]) if e in self._shared else self._lower(e)
        return self._known[e]

    def _lower(self, e: Any) -> int:
        if not e.free_symbols:
            return self._constant(float(e))
        if e.is_Add:
            return self._sum(e)
        if e.is_Mul:
            return self._product(e)
        if e.is_Pow:
            return self._power(e.base, e.exp)
        (argument,) = (self._value(a) for a in e.args)
        if isinstance(e, Magnitude | Direction):
            return self._emit("abs" if isinstance(e, Magnitude) else "sign", argument)
        name = e.func.__name__
        assert name in FUNCTIONS, name
        return self._emit(name, argument)

    def _sum(self, e: Any) -> int:
        plus: list[Any] = []
        minus: list[Any] = []
        for term in e.args:
            factor, _ = term.as_coeff_Mul()
            (minus if factor.is_negative else plus).append(-term if factor.is_negative else term)
        # What is no product goes first: products are then added to it in one operation each.
        plus.sort(key=_is_product)
        minus.sort(key=_is_product)
        total = self._value(plus.pop(0)) if plus else self._emit("negate", self._value(minus.pop(0)))
        for term in plus:
            total = self._emit("add", total, self._value(term))
        for term in minus:
            total = self._emit("subtract", total, self._value(term))
        return total

    def _product(self, e: Any) -> int:
        factor, rest = e.as_coeff_Mul()
        if factor == -1:
            return self._emit("negate", self._value(rest))
        total = self._value(e.args[0])
        for argument in e.args[1:]:
            total = self._emit("multiply", total, self._value(argument))
        return total

    def _power(self, base: Any, exponent: Any) -> int:
        x = self._value(base)
        if exponent.is_Rational and exponent.q in (1, 2, 3):
            root = {1: x, 2: "sqrt", 3: "cbrt"}[int(exponent.q)]
            return self._integer_power(self._emit(root, x) if isinstance(root, str) else x, int(exponent.p))
        return self._emit("power", x, self._value(exponent))

    def _integer_power(self, x: int, n: int) -> int:
        if n < 0:
            return self._integer_power(self._emit("divide", self._constant(1.0), x), -n)
        if n == 1:
            return x
        half = self._integer_power(x, n // 2)
        square = self._emit("multiply", half, half)
        return self._emit("multiply", square, x) if n % 2 else square

    def _uses(self) -> list[int]:
        """How often each value is needed; 0 for what no output depends on."""
        uses = [0] * len(self.nodes)
        for k in self.outputs:
            uses[k] += 1
        for k in reversed(range(len(self.nodes))):
            for operand in self.nodes[k].operands if uses[k] else ():
                uses[operand] += 1
        return uses

    def fuse(self) -> None:
        """Turn x * (1/y) into x/y and products that are added into multiply-adds, where nothing else needs them."""
        uses, one = self._uses(), self._constant(1.0)
        uses += [0] * (len(self.nodes) - len(uses))
        for k, node in enumerate(self.nodes):
            if node.name == "multiply":
                for x, y in (node.operands, node.operands[::-1]):
                    other = self.nodes[y]
                    if other.name == "divide" and other.operands[0] == one and uses[y] == 1:
                        self.nodes[k] = _Node("divide", (x, other.operands[1]))
                        break
            elif node.name in ("add", "subtract"):
                self._fuse_sum(k, uses)

    def _fuse_sum(self, k: int, uses: list[int]) -> None:
        name, (x, y) = self.nodes[k].name, self.nodes[k].operands
        single = [self.nodes[v].name == "multiply" and uses[v] == 1 for v in (x, y)]
        if single[1]:
            fused = "multiply_add" if name == "add" else "subtract_product"
            self.nodes[k] = _Node(fused, (*self.nodes[y].operands, x))
        elif single[0]:
            fused = "multiply_add" if name == "add" else "multiply_subtract"
            self.nodes[k] = _Node(fused, (*self.nodes[x].operands, y))

    def allocate(self) -> OperationList:
        """Each value in a register, which is free again after the last use of the value."""
        uses = self._uses()
        needed = [k for k, count in enumerate(uses) if count]
        constants = [k for k in needed if self.nodes[k].name == "constant"]
        register = {k: int(node.value) for k, node in enumerate(self.nodes) if node.name == "given"}
        register |= {k: self.given + i for i, k in enumerate(constants)}
        count = len(register)
        free = [r for k, r in register.items() if not uses[k]]
        heapq.heapify(free)
        operations, rows = [], []
        for k in needed:
            node = self.nodes[k]
            if node.name in ("given", "constant"):
                continue
            operands = [register[v] for v in node.operands]
            for v in node.operands:
                uses[v] -= 1
                if not uses[v]:
                    heapq.heappush(free, register[v])
            register[k] = heapq.heappop(free) if free else count
            count += register[k] == count
            operations.append(_CODES[node.name])
            rows.append([register[k], *operands, *[0] * (3 - len(operands))])
        _require_room(count, len(operations))
        return OperationList(
            np.array(operations, dtype=np.int32),
            np.array(rows, dtype=np.int32).reshape(-1, 4),
            np.array([self.nodes[k].value for k in constants], dtype=np.float64),
            np.array([register[k] for k in self.outputs], dtype=np.int32),
        )


def _is_product(term: Any) -> bool:
    return bool(term.is_Mul)


def _require_room(registers: int, operations: int) -> None:
    for what, count, most in (
        ("registers", registers, _native.MAX_REGISTERS),
        ("operations", operations, _native.MAX_OPERATIONS),
    ):
        if count > most:
            raise InputError(f"psi takes {count} {what} with its derivatives, must be <= {most}")
