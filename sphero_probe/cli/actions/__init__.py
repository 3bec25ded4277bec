"""What each command does: one file per command, imported when the command is called."""
