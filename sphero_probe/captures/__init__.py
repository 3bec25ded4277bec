"""What others recorded: capture files in, the packets of robots out, with time, direction and connection.

``reader.open_capture`` is the way in. No I/O but reads of the file it is given, no clock.
"""
