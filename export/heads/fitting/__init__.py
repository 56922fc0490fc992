"""A head fitted to one photo, in numpy and torch: the reference of sdk/src/head/fit."""
