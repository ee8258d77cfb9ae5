"""What Foxglove, Lichtblick and Rerun show: our messages in Foxglove's schemas, as protobuf."""
