"""Run one action on many robots at once: one process, one event loop.

``Fleet`` is the main class. It gives each robot a task of its own, and yields pairs of robot and record as
things happen. ``on_robot.run_on_robot`` is the work on one robot: it waits for a place on a Bluetooth adapter
(``adapters``), connects, runs the action (``action``) and ends with one ``Ended``, whatever went wrong. It
knows nothing of the other robots, so that another program, or another host, can run it for a single robot.
"""
