"""Connect to a robot. The main class is ``session.Session``, which ``session.open_session`` returns.

A session has the open link, what is known about the robot, and a way to connect to the same robot again.
``addressing`` tells model and protocol from a device address, ``commands`` turns what a user typed into
commands, ``identify`` wakes a robot and reads its firmware, ``identity`` compares two robots, and
``reconnect`` keeps a link over its drops.
"""
