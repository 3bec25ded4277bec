"""One conversation with one robot: commands in, exchanges out, and nothing sent that was not allowed."""
