"""What is found, as plain data: verdict, causes, limits, gain; what a report shows of the place; a plan."""
