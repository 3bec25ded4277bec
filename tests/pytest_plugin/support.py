"""Runs the plugin in a nested pytest, whether or not this checkout is installed."""

from importlib.metadata import entry_points

PLUGIN = "sphero_probe.pytest_plugin"


def plugin_options(*options: str) -> tuple[str, ...]:
    """Return pytest options that load the plugin, if no installed entry point does."""
    installed = any(point.value == PLUGIN for point in entry_points(group="pytest11"))
    load = () if installed else ("-p", PLUGIN)
    return (*load, "-p", "no:randomly", "-p", "no:cacheprovider", *options)
