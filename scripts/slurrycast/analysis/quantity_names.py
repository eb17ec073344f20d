"""Names that stand for several phases in the quantities of a microstructure, and what a phase can't be called."""

SUMS = ("all", "ceramic", "nonceramic", "organic", "void")
