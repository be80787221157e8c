"""The links to robots: one interface for every kind of them, and what all kinds share."""
