"""Laws as C functions, translated from what JAX traces of them: a new law needs no C of its own.

A use of a law with its parameters is traced on scalar signals and states; what depends on parameters alone is a number
by then. The rest is a list of operations on scalars, each of which is one line of C.
"""

from __future__ import annotations

import twin.float64  # noqa: F401  isort: skip  laws are traced in double precision

import math
import re
from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from twin.errors import TwinError
from twin.physics.laws import LAWS
from twin.rom.law_values import parameters_of, states_of
from twin.rom.load_model import LawUse

_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "gt": ">", "lt": "<", "ge": ">=", "le": "<=", "eq": "==",
          "ne": "!="}  # fmt: skip
_CALLS = {"exp": "EXP", "log": "LOG", "sqrt": "SQRT", "tan": "TAN", "atan": "ATAN", "cos": "COS", "sin": "SIN",
          "abs": "FABS", "pow": "POW", "max": "FMAX", "min": "FMIN", "expm1": "EXPM1", "log1p": "LOG1P"}  # fmt: skip
_LOGIC = {"and": "&&", "or": "||"}
_SAME = ("convert_element_type", "copy", "stop_gradient", "broadcast_in_dim", "squeeze", "reshape")
_INTERPOLATION = "_interp"  # jax.numpy.interp, whose search is a loop: the C code has its own


def number(value: float) -> str:
    """A number in C, exact in double precision."""
    if math.isnan(value) or math.isinf(value):
        return "NAN" if math.isnan(value) else ("INFINITY" if value > 0 else "(-INFINITY)")
    text = repr(float(value))
    return f"R({text})" if value >= 0 else f"(R({text}))"


def arguments_of(use: LawUse) -> tuple[str, ...]:
    """The arguments of the C function of a use: signals by name of the argument, then states."""
    return (*sorted(use.signals), *states_of(use))


def law_code(name: str, use: LawUse, holds: bool = False) -> str:
    """A C function `name` of one law, or of whether it is inside its validity, at values of `arguments_of(use)`.

    Raises TwinError for a law that uses an operation without a line of C.
    """
    law, parameters, arguments = LAWS[use.law], parameters_of(use), arguments_of(use)
    function = law.validity.holds if holds and law.validity else law.function

    def traced(*values: Any) -> Any:
        return function(**dict(zip(arguments, values, strict=True)), **parameters)

    own = [f"{a}_in" for a in arguments]  # some arguments are words of C, such as switch
    lines, result = _translated(traced, own, use.law)
    lines = _needed(lines, result)
    given = ", ".join(f"real {a}" for a in own) or "void"
    unused = "".join(f"    (void){a};\n" for a in own)
    kind = "int" if holds else "real"
    return f"static {kind} {name}({given})\n{{\n{unused}{''.join(lines)}    return {result};\n}}\n"


def _translated(function: Callable, arguments: list[str], law: str) -> tuple[list[str], str]:
    closed = jax.make_jaxpr(function)(*([np.float64(1.0)] * len(arguments)))
    lines: list[str] = []
    counter = iter(range(1_000_000))
    (result,) = _lines(closed.jaxpr, closed.consts, arguments, lines, counter, law)
    return lines, result


def _needed(lines: list[str], result: str) -> list[str]:
    """The lines that the result depends on: compilers warn of others."""
    wanted, kept = set(re.findall(r"\bv\d+\b", result)), []
    for line in reversed(lines):
        name = re.search(r"const (?:real|int) (v\d+) = ", line)
        if name and name[1] in wanted:
            wanted |= set(re.findall(r"\bv\d+\b", line))
            kept.append(line)
    return kept[::-1]


def _lines(jaxpr: Any, consts: Any, given: list[str], lines: list[str], counter: Any, law: str) -> list[str]:
    """Append the lines of a traced function; returns the names of its results. Inner functions are written in place."""
    names: dict[Any, str] = dict(zip(jaxpr.invars, given, strict=True))
    tables: dict[Any, np.ndarray] = {}
    for variable, value in zip(jaxpr.constvars, consts, strict=True):
        _constant(variable, value, names, tables)

    def read(atom: Any) -> str:
        if hasattr(atom, "val"):
            return _literal(atom.val)
        return names[atom]

    for equation in jaxpr.eqns:
        kind, inner = equation.primitive.name, equation.params.get("jaxpr") or equation.params.get("call_jaxpr")
        if inner is not None and _INTERPOLATION in str(equation.params.get("name", "")):
            x, at, values = equation.invars[:3]
            found = [np.asarray(a.val) if hasattr(a, "val") else tables[a] for a in (at, values)]
            texts = ["{" + ", ".join(number(v) for v in row) + "}" for row in found]
            k = next(counter)
            tables_of = f"    static const real x{k}[] = {texts[0]};\n    static const real y{k}[] = {texts[1]};\n"
            lines.append(f"{tables_of}    const real v{k} = interpolated(x{k}, y{k}, {len(found[0])}, {read(x)});\n")
            names[equation.outvars[0]] = f"v{k}"
        elif inner is not None:
            body = getattr(inner, "jaxpr", inner)
            results = _inner(body, getattr(inner, "consts", ()), equation, read, tables, lines, counter, law)
            names |= dict(zip(equation.outvars, results, strict=True))
        else:
            k = next(counter)
            boolean = equation.outvars[0].aval.dtype == np.bool_
            text = _operation(kind, [read(a) for a in equation.invars], equation, law)
            lines.append(f"    const {'int' if boolean else 'real'} v{k} = {text};\n")
            names[equation.outvars[0]] = f"v{k}"
    return [read(v) for v in jaxpr.outvars]


def _inner(
    body: Any, consts: Any, equation: Any, read: Any, tables: dict, lines: list[str], counter: Any, law: str
) -> list[str]:
    """An inner function, whose tables may be those of the outer one."""
    named = [read(a) if not (not hasattr(a, "val") and a in tables) else "" for a in equation.invars]
    for inside, outside in zip(body.invars, equation.invars, strict=True):
        if not hasattr(outside, "val") and outside in tables:
            tables[inside] = tables[outside]
    return _lines(body, consts, named, lines, counter, law)


def _constant(variable: Any, value: Any, names: dict, tables: dict) -> None:
    array = np.asarray(value)
    if array.ndim:
        tables[variable] = array
    else:
        names[variable] = _literal(array)


def _literal(value: Any) -> str:
    array = np.asarray(value)
    if array.dtype == np.bool_:
        return str(int(array))
    return number(float(array))


def _operation(kind: str, a: list[str], equation: Any, law: str) -> str:
    if kind in _INFIX:
        return f"{a[0]} {_INFIX[kind]} {a[1]}"
    if kind in _CALLS:
        return f"{_CALLS[kind]}({', '.join(a)})"
    if kind in _LOGIC:
        return f"{a[0]} {_LOGIC[kind]} {a[1]}"
    if kind in _SAME:
        return a[0]
    simple = {
        "neg": lambda: f"-{a[0]}",
        "not": lambda: f"!{a[0]}",
        "select_n": lambda: f"{a[0]} ? {a[2]} : {a[1]}",
        "clamp": lambda: f"FMIN(FMAX({a[1]}, {a[0]}), {a[2]})",
        "square": lambda: f"{a[0]} * {a[0]}",
        "sign": lambda: f"(real)(({a[0]} > 0) - ({a[0]} < 0))",
        "integer_pow": lambda: _power(a[0], int(equation.params["y"])),
    }
    if kind not in simple:
        raise TwinError(f"law '{law}' uses the operation '{kind}', which is not known in C", "export",
                        "add it to twin/export/c/law_code.py")  # fmt: skip
    return simple[kind]()


def _power(x: str, y: int) -> str:
    product = " * ".join([x] * abs(y)) or "R(1.0)"
    return product if y >= 0 else f"R(1.0) / ({product})"
