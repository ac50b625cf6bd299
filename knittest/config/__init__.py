"""Config models, the hardened YAML reader and the loading of a run."""
