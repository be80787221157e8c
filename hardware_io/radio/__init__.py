"""Commands to robots and their answers, by XBee radio."""
