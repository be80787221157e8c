"""`sightfield schedule`: an answer as a table, as JSON and as a load diagram."""
