"""sphero-probe: map what a Sphero robot can do, from the terminal."""

__version__ = "0.1.0"
