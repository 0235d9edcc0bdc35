"""Trials that are kept: how each is made, and the files that hold their truths."""
