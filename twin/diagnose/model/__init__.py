"""The reduced model that has seen heat, films and lost contacts at every place, and its time integration."""
