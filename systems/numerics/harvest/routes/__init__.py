"""Routes of grain carts over cut ground: lanes beside combines, ways between them, steering."""
