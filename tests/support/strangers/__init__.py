"""Robots with habits that nobody modelled: an independent robot, its pipe, and a judge of what is said of it.

``frames``, ``commands``, ``robot`` and ``habits`` share no code with the project: they read and write frames
by themselves, and what they know of commands was copied from the published record. So a mistake that the
project and its own simulator have in common still shows here.
"""
