"""Cited pure functions: losses and film coefficients, one explicit table LAWS."""
