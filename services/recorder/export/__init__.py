"""What people take out of a log: a table of decisions, pictures of the camera and of the map."""
