"""Cited pure functions: losses and film coefficients, one explicit table LAWS."""

import twin.float64  # noqa: F401  laws are evaluated in double precision wherever they are imported first
