"""Words and arithmetic that know no robot."""
