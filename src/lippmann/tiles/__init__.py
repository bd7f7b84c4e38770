"""Pictures in tiles: the job, the rendering of one tile and of all, and the margins around a tile."""
