"""What robots are: their measures, limits, sensors and the words they understand."""
