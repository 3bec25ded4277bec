"""The known commands, one row each; a file per generation and area."""
