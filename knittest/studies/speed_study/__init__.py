"""``knittest speed-study``: every rig at its speed and at half of it, as a table."""
