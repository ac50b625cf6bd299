"""Executes, keeps and shows the runs of a test: folders, checkpoints, specimens, tables; checks before them."""
