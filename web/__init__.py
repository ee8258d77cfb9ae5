"""The page: what the robot believes, drawn in a browser, and what a person wants, sent back."""
