"""What stands behind ``import sphero_probe``: everything that a script or a notebook needs in five lines.

``ConnectedRobot`` (``robot``) is the main class: ``connect`` (``connecting``) opens one, and its methods
return an ``Answer`` (``answer``) for one command, a ``RunningPlan`` (``running``) for a sweep,
``Notifications`` (``notifications``) for what the robot sends by itself. A finished run is a ``Run``
(``result``), of this process or of a journal file. ``decoding`` needs no robot.

Commands pass the same policy as on the command line: whatever ``sphero-probe send`` refuses, ``send``
refuses. The API opens a link through ``session`` and asks through ``probing``; it never writes to a transport
itself.
"""
