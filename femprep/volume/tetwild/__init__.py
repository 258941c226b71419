"""fTetWild behind a guard: the attempts, the child process, and what runs in it."""
