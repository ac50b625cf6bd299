"""Pull-out: one inlay is pulled out of a piece of fabric."""
