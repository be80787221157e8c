"""Where and when grain carts drive: beside combines, over cut ground, to trucks."""
