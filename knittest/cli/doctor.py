"""``knittest doctor``."""

import click


@click.command()
@click.option("--clear-cache", is_flag=True, help="Empty the cache of compiled kernels and relaxed cells.")
def doctor(clear_cache: bool) -> None:
    """Report versions, cores, threading layer and cache folder; or empty the cache.

    Compiled kernels and relaxed cells are made anew when they are needed, which takes minutes.

    Example: knittest doctor

    Example: knittest doctor --clear-cache
    """
    if clear_cache:
        from knittest.base.cache import cache_root, clear

        root = cache_root()
        click.echo(f"{root}: {clear(root) / 1e6:.1f} MB removed" if root else "there is no cache folder")
        return
    import os
    import sys

    from knittest import __version__
    from knittest.base.cache import cache_root
    from knittest.base.resources import configs_dir, data_dir
    from knittest.export.provenance import cpu_model, library_versions
    from knittest.kernels.threading import threading_layer
    from knittest.solve.threads import use_threads

    threads = use_threads(None)
    layer = threading_layer()
    slow = " (slow: a fork costs 55 us; install libgomp or tbb, one thread is used until then)"
    rows = {
        "knittest": __version__,
        "python": sys.version.split()[0],
        **library_versions(),
        "processor": cpu_model(),
        "cores": str(os.cpu_count()),
        "threads used": str(threads),
        "threading layer": layer + (slow if layer == "workqueue" else ""),
        "cache folder": str(cache_root() or "none: nothing is cached"),
        "configs": str(configs_dir()),
        "data": str(data_dir()),
    }
    width = max(map(len, rows))
    for name, value in rows.items():
        click.echo(f"{name:<{width}}  {value}")
