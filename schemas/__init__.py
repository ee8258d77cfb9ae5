"""The language of the system: every message, topic and query, and how they become bytes."""
