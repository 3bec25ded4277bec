"""The Python API, which ``import sphero_probe`` exports.

``ConnectedRobot`` (``robot``) is the main class: ``connect`` (``connecting``) opens one, and its methods
return an ``Answer`` (``answer``) for one command, a ``RunningPlan`` (``running``) for a sweep,
``Notifications`` (``notifications``) for what the robot sends by itself. A ``Run`` (``result``) holds a
finished run, from this process or from a journal file. ``decoding`` needs no robot.

Commands pass the same policy as on the command line: ``send`` blocks what ``sphero-probe send`` blocks. The
API opens a link through ``session`` and sends probes through ``probing``; it never writes to a transport
itself.
"""
