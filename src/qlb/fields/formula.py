"""Formulas: written as text, turned into a few numpy operations, without `eval`."""

from __future__ import annotations

import ast
import operator
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np

from qlb.errors import InputError

MAX_LENGTH = 1000
MAX_DEPTH = 100
MAX_OPERATIONS = 1000

CONSTANTS = {"pi": np.pi}
FUNCTIONS: dict[str, tuple[Callable[..., Any], int]] = {
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "tan": (np.tan, 1),
    "exp": (np.exp, 1),
    "log": (np.log, 1),
    "sqrt": (np.sqrt, 1),
    "abs": (np.abs, 1),
    "floor": (np.floor, 1),
    "ceil": (np.ceil, 1),
    "minimum": (np.minimum, 2),
    "maximum": (np.maximum, 2),
    "where": (np.where, 3),
    "clip": (np.clip, 3),
}
"""What an expression can call, with the number of arguments."""


def allowed(variables: Sequence[str]) -> str:
    """What a formula of `variables` may hold, in words."""
    return (
        f"numbers, {', '.join((*variables, *CONSTANTS))}, + - * / // % **, comparisons, and the functions"
        f" {', '.join(FUNCTIONS)}"
    )


_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}

_CONSTRUCTS: dict[type[ast.AST], str] = {
    ast.Attribute: "attribute access",
    ast.Subscript: "a subscript",
    ast.Lambda: "a lambda",
    ast.ListComp: "a comprehension",
    ast.SetComp: "a comprehension",
    ast.DictComp: "a comprehension",
    ast.GeneratorExp: "a comprehension",
    ast.JoinedStr: "an f-string",
    ast.NamedExpr: "an assignment",
    ast.IfExp: "if ... else (write where(condition, a, b))",
    ast.BoolOp: "and/or (write a product of comparisons, or maximum)",
    ast.Starred: "a starred argument",
    ast.List: "a list",
    ast.Tuple: "a tuple",
    ast.Set: "a set",
    ast.Dict: "a dictionary",
    ast.Yield: "yield",
    ast.YieldFrom: "yield",
    ast.Await: "await",
    ast.Invert: "the operator ~",
    ast.Not: "the operator not",
    ast.MatMult: "the operator @",
    ast.BitAnd: "the operator &",
    ast.BitOr: "the operator |",
    ast.BitXor: "the operator ^ (a power is **)",
    ast.LShift: "the operator <<",
    ast.RShift: "the operator >>",
    ast.In: "the operator in",
    ast.NotIn: "the operator not in",
    ast.Is: "the operator is",
    ast.IsNot: "the operator is not",
}

Operation = tuple[Callable[..., Any], int]
Instruction = float | str | Operation
"""A number, the name of a variable, or a function of the last so many values (reverse Polish notation)."""


@dataclass(frozen=True)
class Formula:
    """A formula of some variables, such as "2e4 * (1 + 9 * (x > 0.5))" of x, y, z.

    Attributes:
        text: the formula, with runs of white space made one blank.
        variables: the names that it may use.

    Raises:
        InputError: anything that is not `allowed`; the message names it, with its column.
    """

    text: str
    variables: tuple[str, ...]
    _program: tuple[Instruction, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", " ".join(self.text.split()))
        object.__setattr__(self, "_program", _Compiler(self.text, self.variables).program)

    @property
    def is_constant(self) -> bool:
        """Whether it uses none of its variables."""
        return not any(isinstance(step, str) for step in self._program)

    def __call__(self, *values: Any) -> Any:
        """Its value where the variables have `values`, of which each is an array or a number, all of one shape.

        Infinite or NaN where it is not defined; a single number where the formula is constant.
        """
        stack: list[Any] = []
        with np.errstate(all="ignore"):
            for step in self._program:
                if isinstance(step, str):
                    stack.append(np.asarray(values[self.variables.index(step)], dtype=np.float64))
                elif isinstance(step, float):
                    stack.append(np.float64(step))
                else:
                    function, count = step
                    arguments = stack[-count:]
                    stack[-count:] = [np.asarray(function(*arguments), dtype=np.float64)]
        return stack[0]

    def __str__(self) -> str:
        """Quotes the text."""
        return _shown(self.text)


class _Compiler:
    """Turns the text of a formula into instructions, or refuses it."""

    def __init__(self, text: str, variables: tuple[str, ...]) -> None:
        self.text, self._variables = text, variables
        self._allowed = f"allowed are {allowed(variables)}"
        self._steps: list[Instruction] = []
        self._visit(_parsed(text, self._allowed), MAX_DEPTH)
        self.program = tuple(self._steps)

    def _visit(self, node: ast.expr, depth: int) -> None:
        if depth == 0:
            self._refuse(node, "is nested too deep", f"at most {MAX_DEPTH} levels are allowed")
        match node:
            case ast.Constant():
                self._emit(node, self._number(node))
            case ast.Name():
                self._name(node)
            case ast.UnaryOp():
                self._visit(node.operand, depth - 1)
                self._emit(node, (self._operator(node, node.op), 1))
            case ast.BinOp():
                self._visit(node.left, depth - 1)
                self._visit(node.right, depth - 1)
                self._emit(node, (self._operator(node, node.op), 2))
            case ast.Compare():
                self._compare(node, depth - 1)
            case ast.Call():
                self._call(node, depth - 1)
            case _:
                self._not_allowed(node, node)

    def _compare(self, node: ast.Compare, depth: int) -> None:
        """a < b < c is (a < b) * (b < c)."""
        sides = [node.left, *node.comparators]
        for k, op in enumerate(node.ops):
            self._visit(sides[k], depth)
            self._visit(sides[k + 1], depth)
            self._emit(node, (self._operator(node, op), 2))
            if k:
                self._emit(node, (operator.mul, 2))

    def _call(self, node: ast.Call, depth: int) -> None:
        name = node.func.id if isinstance(node.func, ast.Name) else None
        if name is None:
            self._not_allowed(node.func, node.func, "a call of something without a name")
        if name not in FUNCTIONS:
            self._refuse(node, f"calls {_shown(name)}, which is not known", self._allowed)
        function, count = FUNCTIONS[name]
        if node.keywords:
            self._refuse(node, f"calls {name} with an argument by name", "arguments have no names")
        if len(node.args) != count:
            self._refuse(node, f"calls {name} with {len(node.args)} arguments", f"it takes {count}")
        for argument in node.args:
            self._visit(argument, depth)
        self._emit(node, (function, count))

    def _name(self, node: ast.Name) -> None:
        if node.id in self._variables:
            self._emit(node, node.id)
        elif node.id in CONSTANTS:
            self._emit(node, float(CONSTANTS[node.id]))
        elif node.id in FUNCTIONS:
            count = FUNCTIONS[node.id][1]
            self._refuse(node, f"names the function {node.id} without calling it", f"it takes {count} in parentheses")
        else:
            self._refuse(node, f"uses {_shown(node.id)}, which is not known", self._allowed)

    def _number(self, node: ast.Constant) -> float:
        value = node.value
        if isinstance(value, bool) or not isinstance(value, int | float):
            kind = {str: "a string", bytes: "a string", complex: "a complex number"}.get(type(value), repr(value))
            self._not_allowed(node, node, kind)
        try:
            return float(value)
        except OverflowError:
            self._refuse(node, "holds a number that is too large", "at most 1.8e308 is allowed")

    def _operator(self, node: ast.expr, op: ast.AST) -> Callable[..., Any]:
        if type(op) not in _OPERATORS:
            self._not_allowed(node, op)
        return _OPERATORS[type(op)]

    def _emit(self, node: ast.expr, step: Instruction) -> None:
        if len(self._steps) == MAX_OPERATIONS:
            self._refuse(node, "is too long", f"at most {MAX_OPERATIONS} operations are allowed")
        self._steps.append(step)

    def _not_allowed(self, node: ast.expr, construct: ast.AST, name: str = "") -> NoReturn:
        name = _CONSTRUCTS.get(type(construct), name or type(construct).__name__)
        self._refuse(node, f"has {name}", self._allowed)

    def _refuse(self, node: ast.expr, problem: str, allowed: str) -> NoReturn:
        column = len(self.text.encode()[: node.col_offset].decode(errors="replace")) + 1
        raise _refusal(self.text, f"{problem} (column {column})", allowed)


def _parsed(text: str, allowed: str) -> ast.expr:
    if not text:
        raise _refusal(text, "is empty", allowed)
    if len(text) > MAX_LENGTH:
        raise _refusal(text, f"has {len(text)} characters", f"at most {MAX_LENGTH} are allowed")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the parser, about what is refused below
            return ast.parse(text, mode="eval").body
    except SyntaxError as error:
        where = f" (column {error.offset})" if error.offset else ""
        raise _refusal(text, f"is not a formula: {error.msg}{where}", allowed) from None
    except (RecursionError, MemoryError):
        raise _refusal(text, "is nested too deep", f"at most {MAX_DEPTH} levels are allowed") from None
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise _refusal(text, f"is not a formula: {reason}", allowed) from None


def _refusal(text: str, problem: str, allowed: str) -> InputError:
    return InputError(f"{_shown(text)} is not a number, and as an expression it {problem}; {allowed}")


def _shown(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:57] + "...")
