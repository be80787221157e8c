"""The kinds of robots that a station can drive, each with a link and with robots that stand in."""
