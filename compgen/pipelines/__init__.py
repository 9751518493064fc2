"""The stories: how files become a job, and what is done with it."""
