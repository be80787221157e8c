"""How a combine gets from one pose to another on the ground that it may drive on."""
