"""What the commands do, one module each; a command imports its module when it runs, so help stays quick."""
