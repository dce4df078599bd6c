# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The small faults that ``mutate.py`` puts into a file, one at a time.

Each replaces a few bytes; the rest of the file stays as it is. Text, annotations, decorators,
assertions, logging and what an exception is made of are left alone.
"""

import ast
from collections.abc import Iterable
from itertools import pairwise
import re
from typing import NamedTuple

_OPERATORS = {
    ast.Lt: ('<', '<=', '>='), ast.LtE: ('<=', '<', '>'), ast.Gt: ('>', '>=', '<='),
    ast.GtE: ('>=', '>', '<'), ast.Eq: ('==', '!='), ast.NotEq: ('!=', '=='),
    ast.Is: ('is', 'is not'), ast.IsNot: ('is not', 'is'), ast.In: ('in', 'not in'),
    ast.NotIn: ('not in', 'in'), ast.And: ('and', 'or'), ast.Or: ('or', 'and'),
    ast.Add: ('+', '-'), ast.Sub: ('-', '+'), ast.Mult: ('*', '/'), ast.Div: ('/', '*'),
    ast.FloorDiv: ('//', '*'), ast.Mod: ('%', '//'), ast.Pow: ('**', '*'),
    ast.LShift: ('<<', '>>'), ast.RShift: ('>>', '<<'), ast.BitAnd: ('&', '|'),
    ast.BitOr: ('|', '&'), ast.BitXor: ('^', '&')}
_TWINS = {'min': 'max', 'max': 'min', 'any': 'all', 'all': 'any', 'minimum': 'maximum',
          'maximum': 'minimum', 'bisect_left': 'bisect_right', 'bisect_right': 'bisect_left'}
# With these, the order of the arguments does not matter, or is always the same mistake.
_UNORDERED = {'min', 'max', 'minimum', 'maximum', 'isclose', 'gcd', 'isinstance', 'issubclass',
              'suppress'}
# Calls that only print, or that only a type checker uses.
_SILENT = re.compile(
    r'(\w+\.)*\w*log(ger)?\.\w+|(\w+\.)?warn(ing)?|print|TypeVar|NewType|ParamSpec')
_TESTED = (ast.Name, ast.Attribute, ast.Subscript, ast.Call)
_STORED = (ast.Attribute, ast.Subscript)


class Mutant(NamedTuple):
    """
    A fault.

    :ivar place: the function or class that it is in; '' for the module.
    :ivar line: the first line that it changes.
    :ivar lines: those of its statement; of ``if`` and the like, without the body.
    :ivar begin: where the bytes begin that it replaces.
    :ivar end: where they end.
    """

    place: str
    line: int
    lines: range
    begin: int
    end: int
    replacement: bytes

    def apply(self, source: bytes) -> bytes:
        """Return the source with this fault."""
        return source[:self.begin] + self.replacement + source[self.end:]

    def texts(self, source: bytes) -> tuple[str, str]:
        """Return the lines that it changes before and after, each joined to one."""
        first = source.rfind(b'\n', 0, self.begin) + 1
        behind = (source + b'\n').index(b'\n', self.end)
        mutated = source[first:self.begin] + self.replacement + source[self.end:behind]
        before, after = (' '.join(text.decode().split())
                         for text in (source[first:behind], mutated))
        return before, after


def mutants_of(source: bytes) -> list[Mutant]:
    """Return all faults for the source of a file, from its beginning to its end."""
    return sorted(_Finder(source).found, key=lambda each: each[3:])


def _lines_of(node: ast.stmt) -> range:
    body = getattr(node, 'body', None)
    end = body[0].lineno if body else node.end_lineno + 1
    return range(node.lineno, max(end, node.lineno + 1))


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant)
                                               and isinstance(node.value, str | bytes))


class _Finder(ast.NodeVisitor):
    """Collects the mutants of a file in ``found``."""

    def __init__(self, source: bytes) -> None:
        self.found: list[Mutant] = []
        self._source = source
        self._starts = [0]
        for line in source.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))
        self._place: tuple[str, ...] = ()
        self._lines = range(0)
        self.visit(ast.parse(source))

    def visit(self, node: ast.AST) -> None:
        """Visit a node; keep the lines of its statement."""
        outer = self._lines
        if isinstance(node, ast.stmt):
            self._lines = _lines_of(node)
        super().visit(node)
        self._lines = outer

    def _visit_all(self, nodes: Iterable[ast.AST | None]) -> None:
        for node in nodes:
            if node is not None:
                self.visit(node)

    # --- the bytes of a node, and their replacements

    def _span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        return (self._starts[node.lineno - 1] + node.col_offset,
                self._starts[node.end_lineno - 1] + node.end_col_offset)

    def _text(self, node: ast.expr) -> str:
        begin, end = self._span(node)
        return self._source[begin:end].decode()

    def _add(self, begin: int, end: int, replacement: str) -> None:
        line = self._source.count(b'\n', 0, begin) + 1
        self.found.append(Mutant('.'.join(self._place), line, self._lines, begin, end,
                                 replacement.encode()))

    def _replace(self, node: ast.expr | ast.stmt, replacement: str) -> None:
        self._add(*self._span(node), replacement)

    def _replace_operator(self, left: ast.expr, operator: ast.AST, right: ast.expr) -> None:
        word, *others = _OPERATORS.get(type(operator), ('',))
        begin, end = self._span(left)[1], self._span(right)[0]
        gap = self._source[begin:end]
        at = gap.find(word.encode())
        if at >= 0 and b'#' not in gap:
            for other in others:
                self._add(begin + at, begin + at + len(word), other)

    def _negate(self, test: ast.expr) -> None:
        if isinstance(test, _TESTED):
            self._replace(test, f'not {self._text(test)}')

    # --- definitions

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        outer, self._place = self._place, (*self._place, node.name)
        self._visit_all([*node.args.defaults, *node.args.kw_defaults, *node.body])
        self._place = outer

    visit_AsyncFunctionDef = visit_FunctionDef

    def visit_Lambda(self, node: ast.Lambda) -> None:
        self._visit_all([*node.args.defaults, *node.args.kw_defaults, node.body])

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        outer, self._place = self._place, (*self._place, node.name)
        self._visit_all(node.body)
        self._place = outer

    # --- statements

    def visit_Expr(self, node: ast.Expr) -> None:
        self.visit(node.value)
        value = node.value.value if isinstance(node.value, ast.Await) else node.value
        if isinstance(value, ast.Call) and not self._is_silent(value):
            self._replace(node, 'pass')

    def visit_Assign(self, node: ast.Assign) -> None:
        if any(isinstance(target, _STORED) for target in node.targets):
            self._replace(node, 'pass')
        self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            if isinstance(node.target, _STORED):
                self._replace(node, 'pass')
            self.visit(node.value)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._replace(node, 'pass')
        self._replace_operator(node.target, node.op, node.value)
        self.generic_visit(node)

    def visit_Delete(self, node: ast.Delete) -> None:
        self._replace(node, 'pass')
        self.generic_visit(node)

    def _visit_removed(self, node: ast.stmt) -> None:
        self._replace(node, 'pass')

    visit_Continue = visit_Break = visit_Raise = _visit_removed

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is None:
            self._replace(node, 'pass')
        else:
            if not isinstance(node.value, ast.Constant | ast.JoinedStr):
                self._replace(node.value, 'None')
            self.visit(node.value)

    def visit_Assert(self, node: ast.Assert) -> None:
        """Leave it alone: most assertions are for the type checker."""

    def visit_If(self, node: ast.If | ast.While | ast.IfExp) -> None:
        if self._text(node.test) != 'TYPE_CHECKING':
            self._negate(node.test)
            self.generic_visit(node)

    visit_While = visit_IfExp = visit_If

    # --- expressions

    def visit_comprehension(self, node: ast.comprehension) -> None:
        for test in node.ifs:
            self._negate(test)
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        operands = [node.left, *node.comparators]
        for (left, right), operator in zip(pairwise(operands), node.ops, strict=True):
            self._replace_operator(left, operator, right)
        # Nothing but None itself is None.
        self._visit_all(each for each in operands if self._text(each) != 'None')

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        for left, right in pairwise(node.values):
            self._replace_operator(left, node.op, right)
            self._drop(left, node.op, right)
        for value in node.values:
            self._negate(value)
        self.generic_visit(node)

    def _drop(self, left: ast.expr, operator: ast.boolop, right: ast.expr) -> None:
        (begin, end), (begin_2, end_2) = self._span(left), self._span(right)
        # With a parenthesis between them, one would be left alone.
        if self._source[end:begin_2].split() == [_OPERATORS[type(operator)][0].encode()]:
            self._add(begin, begin_2, '')
            self._add(end, end_2, '')

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if isinstance(node.op, ast.MatMult):
            self._swap(node.left, node.right)
        # At the top there are unions of types.
        elif not (_is_text(node.left) or _is_text(node.right)
                  or (isinstance(node.op, ast.BitOr) and not self._place)):
            self._replace_operator(node.left, node.op, node.right)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        begin, _ = self._span(node)
        self._add(begin, begin + (4 if isinstance(node.op, ast.Not) else 1), '')
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        if self._is_silent(node):
            return
        name = self._text(node.func).rpartition('.')[2]
        begin, end = self._span(node.func)
        if name in _TWINS:
            self._add(end - len(name), end, _TWINS[name])
        if name not in _UNORDERED and len(node.args) == 2:
            self._swap(*node.args)
        self.visit(node.func)
        # The second argument of isinstance is a type, as is the first one of cast.
        types = {'isinstance': 1, 'issubclass': 1, 'cast': 0}.get(name)
        self._visit_all(each for number, each in enumerate(node.args) if number != types)
        # zip(..., strict=True) is for the reader.
        self._visit_all(each.value for each in node.keywords if each.arg != 'strict')

    def _swap(self, first: ast.expr, second: ast.expr) -> None:
        (begin, end), (begin_2, end_2) = self._span(first), self._span(second)
        one, between, other = self._text(first), self._source[end:begin_2], self._text(second)
        if one != other and not {'*', '('} & {one[0], other[0]} and not set(between) & set(b'()#'):
            self._add(begin, end_2, other + between.decode() + one)

    def _is_silent(self, node: ast.Call) -> bool:
        return bool(_SILENT.fullmatch(self._text(node.func)))

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Leave text alone."""

    def visit_Constant(self, node: ast.Constant) -> None:
        match node.value:
            case bool() as value:
                self._replace(node, str(not value))
            case None:
                self._replace(node, '1')
            case int() as number:
                self._replace(node, str(number + 1))
                self._replace(node, str(number - 1))
            case float() as number:
                self._replace(node, repr(2.0 * number or 1.0))
