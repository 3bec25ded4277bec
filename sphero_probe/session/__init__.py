"""From a device address to an open link with a known robot."""
