"""The verbs of the command line, by theme. A function's signature is its verb's usage."""
