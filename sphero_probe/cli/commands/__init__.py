"""The options of each command, one file per command; its work is in ``sphero_probe.cli.actions``."""
