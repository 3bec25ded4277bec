"""Keep runs on disk. The main classes are ``journal.Journal``, the file, and ``resume.RunJournal``.

``RunJournal`` is what a command uses: it creates the journal of a new run, or reopens and checks that of an
interrupted one. ``Journal`` writes one line per entry. ``encode`` and ``decode`` turn entries into lines and
back; ``fields`` checks each field of a line. ``reader`` reads a journal file, ``lock`` keeps a second process
out, ``store`` manages the folder of journals, and ``folders`` has the places where files are kept.

``diff.compare`` compares two sides. ``sides`` defines a side, ``side_files`` reads one from a journal or a
report, ``listed_sides`` makes one of the catalogue, of a built-in robot's firmware or of a robot's own list.
"""
