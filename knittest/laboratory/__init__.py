"""The virtual laboratory: how each test cuts its specimen, mounts it and reads its results."""
