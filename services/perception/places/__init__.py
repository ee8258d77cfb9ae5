"""What kinds of places a picture shows."""
