"""Quantities that vary in space (tables by region, expressions, functions) or in time (expressions, tables)."""

from qlb.fields.expression import Expression, VectorExpression
from qlb.fields.function import Function
from qlb.fields.in_time import TimeExpression, TimeFunction, TimeTable
from qlb.fields.region_table import RegionTable
from qlb.fields.varying import Varying

__all__ = [
    "Expression",
    "Function",
    "RegionTable",
    "TimeExpression",
    "TimeFunction",
    "TimeTable",
    "Varying",
    "VectorExpression",
]
