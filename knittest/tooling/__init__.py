"""Rigid tools of forming: outlines in plan, edges swept along them, their meshes, and bodies from STL files."""
