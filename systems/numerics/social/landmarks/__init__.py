"""The maze: walls, landmarks with pictures of their own, the evader's marker, and the cameras."""
