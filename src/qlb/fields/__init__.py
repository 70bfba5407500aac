"""Quantities that vary in space: tables by region, expressions and functions of the rest position."""

from qlb.fields.expression import Expression
from qlb.fields.function import Function
from qlb.fields.region_table import RegionTable
from qlb.fields.varying import Varying

__all__ = ["Expression", "Function", "RegionTable", "Varying"]
