"""Where machines drive: poses by way and by time."""
