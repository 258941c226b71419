"""fTetWild behind a guard: the ways to have it fill a wall, the child process, and what runs in it."""
