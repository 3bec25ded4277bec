"""``python -m sphero_probe`` is ``sphero-probe``."""

from sphero_probe.cli import main

main()
