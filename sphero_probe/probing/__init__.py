"""Plans in, findings out: what to ask a robot, asking it, and judging the answers."""
