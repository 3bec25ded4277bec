"""Plans: built in code, loaded from files, shipped with the tool."""
