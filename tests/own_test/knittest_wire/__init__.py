"""Test of the laboratory as a package of its own: a wire is pulled."""
