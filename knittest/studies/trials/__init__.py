"""Trials: runs in processes of their own, each once, kept in a folder with a ledger. For batches and calibrations."""
