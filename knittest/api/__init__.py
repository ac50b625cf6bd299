"""Python interface: calls that do what the commands do, and what a run folder holds as data."""
