"""Strangers: robots with unusual behaviour, written independently of the project, and checks of runs on them.

``frames``, ``commands``, ``robot`` and ``habits`` share no code with the project: they have their own
framing, and their commands were copied from published sources. So they reveal mistakes that the project and
its own simulator have in common.
"""
