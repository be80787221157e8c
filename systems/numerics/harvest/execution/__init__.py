"""How machines drive a plan: on time where they can, in its order where they are late."""
