"""The social network on a Matrix homeserver."""
