"""What stands on the shop floor: description, checks, kinematics."""
