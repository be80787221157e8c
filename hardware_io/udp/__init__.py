"""Small boards on Wi-Fi: a format of datagrams, the link to them, and a board that stands in."""
