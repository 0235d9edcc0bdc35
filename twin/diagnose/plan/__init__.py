"""`--plan`: the next experiment that lowers the limit of a suspicion most."""
