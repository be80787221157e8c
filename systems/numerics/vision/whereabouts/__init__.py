"""Where evaders are and where they may be, from the pictures of all pursuers."""
