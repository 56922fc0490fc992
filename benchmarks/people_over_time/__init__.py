"""Ids of people over time, on clips with exact truth, beside two baselines."""
