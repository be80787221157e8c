"""The corner game, pursuit fields, risk, assignment and evader policies."""
