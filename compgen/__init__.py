"""compgen: predict where a warming robot's tool will be, and write the program that cancels the error."""

__version__ = "0.1.0"
