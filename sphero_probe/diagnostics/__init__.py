"""The checks of ``doctor``: this machine, its Bluetooth, a robot. The main class is ``checkup.Checkup``."""
